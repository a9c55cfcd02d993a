#include "console.h"

#include <stdlib.h>

#include "board.h"
#include "serial.h"

/* Version, reset cause, free stack, each as a letter and a hexadecimal number; the delimiter keeps the next frame intact. */
static void answer(void)
{
    uint16_t values[] = {FIRMWARE_VERSION, board_reset_cause(), board_stack_free()};
    char text[31], *at = text, letter = 'v';
    for (uint8_t i = 0; i < sizeof values / sizeof *values; i++) {
        *at++ = letter++;
        utoa(values[i], at, 16);
        while (*at)
            at++;
        *at++ = ' ';
    }
    *at++ = 0;
    uint8_t length = (uint8_t)(at - text);
    if (serial_room() < length)
        return;
    uint8_t head = serial_head();
    for (at = text; length; length--, head = serial_after(head))
        serial_put(head, (uint8_t)*at++);
    serial_publish(head);
}

bool console_takes(uint8_t byte)
{
    static bool in_frame;
    bool asked = !in_frame && byte == '?';
    in_frame = !asked && byte != 0;
    if (asked)
        answer();
    return asked;
}
