/* Each form of instruction between two writes of port B. */
#include "mark.h"

volatile uint8_t cell;

#define TIMED(code) "out 0x18, r16\n\t" code "\n\tout 0x18, r17\n\t"

int main(void) {
    DDRB = 0xff;
    __asm__ volatile(
        "ldi r16, 1\n\tldi r17, 2\n\tldi r26, lo8(cell)\n\tldi r27, hi8(cell)\n\t"
        "movw r28, r26\n\tldi r30, lo8(gs(1f))\n\tldi r31, hi8(gs(1f))\n\t"
        TIMED("nop") TIMED("add r18, r19") TIMED("adiw r24, 1") TIMED("subi r18, 3") TIMED("mov r18, r19")
        TIMED("movw r18, r20") TIMED("mul r18, r19") TIMED("muls r18, r19") TIMED("fmul r18, r19")
        TIMED("sbi 0x12, 0") TIMED("cbi 0x12, 0") TIMED("in r18, 0x19") TIMED("out 0x15, r18")
        TIMED("ld r18, X") TIMED("ldd r18, Y+1") TIMED("st X, r18") TIMED("std Y+1, r18")
        TIMED("lds r18, cell") TIMED("sts cell, r18") TIMED("push r18") TIMED("pop r18")
        TIMED("lpm r18, Z") TIMED("rjmp .+0") TIMED("jmp 2f\n2:") TIMED("rcall 3f") TIMED("call 3f")
        TIMED("icall") TIMED("clz\n\tbreq .+0") TIMED("sez\n\tbreq .+0")
        TIMED("cpse r16, r17") TIMED("cpse r16, r16\n\tnop") TIMED("cpse r16, r16\n\tjmp 3f")
        TIMED("sbrc r16, 1\n\tnop") TIMED("sbrs r16, 1\n\tnop") TIMED("sbic 0x12, 0\n\tnop") TIMED("wdr") TIMED("bst r16, 0")
        TIMED("swap r18")
        "rjmp 4f\n"
        "1:\n3:\tret\n"
        "4:\n"
        "\tclr r1\n"
        ::: "r0", "r16", "r17", "r18", "r19", "r20", "r21", "r24", "r25", "r26", "r27", "r28", "r29", "r30", "r31", "memory");
    end();
}
