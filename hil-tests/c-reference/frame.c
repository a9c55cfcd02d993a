#include "frame.h"

#include "serial.h"

/* CRC-32C, reflected, bit by bit; the carry that C lacks makes a third of the cycles. The Rust image has the same. */
uint32_t __attribute__((noinline)) crc_update_byte(uint32_t crc, uint8_t byte)
{
    uint8_t left = 8;
    crc ^= byte;
    __asm__("1: lsr %D0\n\t"
            "ror %C0\n\t"
            "ror %B0\n\t"
            "ror %A0\n\t"
            "brcc 2f\n\t"
            "eor %A0, %A2\n\t"
            "eor %B0, %B2\n\t"
            "eor %C0, %C2\n\t"
            "eor %D0, %D2\n\t"
            "2: dec %1\n\t"
            "brne 1b"
            : "+r"(crc), "+r"(left)
            : "d"(0x82f63b78UL));
    return crc;
}

uint32_t crc_update(uint32_t crc, const void *bytes, uint8_t length)
{
    for (const uint8_t *at = bytes; length; length--)
        crc = crc_update_byte(crc, *at++);
    return crc;
}

bool frame_send(uint8_t kind, void *payload, uint8_t length)
{
    enum { CRC_BYTES = 4, CODE_AND_END = 2 };
    struct header *header = payload;
    header->version = WIRE_VERSION;
    header->kind = kind;
    uint8_t left = (uint8_t)(length + CRC_BYTES);
    /* Only a reply may fill the ring: any other frame leaves room for one. */
    uint8_t spare = kind == KIND_REPLY ? 0 : sizeof(struct reply) + CRC_BYTES + CODE_AND_END;
    if (kind != KIND_REPLY && serial_is_to_change())
        return false;
    if (serial_room() < left + CODE_AND_END + spare)
        return false;
    /* Into the ring at once: the interrupt does not see it before the head moves. */
    uint8_t at = serial_head();
    uint8_t code_at = at, code = 1;
    uint32_t crc = CRC_INIT;
    const uint8_t *from = payload;
    for (at = serial_after(at); left; left--, at = serial_after(at)) {
        if (left == CRC_BYTES) {
            static uint32_t tail;
            tail = ~crc;
            from = (const uint8_t *)&tail;
        }
        uint8_t byte = *from++;
        crc = crc_update_byte(crc, byte);
        if (byte) {
            serial_put(at, byte);
            code++;
        } else {
            serial_put(code_at, code);
            code_at = at;
            code = 1;
        }
    }
    serial_put(code_at, code);
    serial_put(at, 0);
    serial_publish(serial_after(at));
    return true;
}

union incoming frame_incoming;

enum received frame_receive(uint8_t byte)
{
    static uint8_t length, run;
    static bool begun, broken;
    static uint32_t crc;

    if (byte == 0) {
        bool was_begun = begun;
        bool intact = !broken && run == 0 && length == sizeof frame_incoming && crc == CRC_RESIDUE &&
                      frame_incoming.request.header.version == WIRE_VERSION &&
                      frame_incoming.request.header.kind == KIND_REQUEST;
        begun = broken = false;
        length = run = 0;
        crc = CRC_INIT;
        return !was_begun ? RECEIVED_NOTHING : intact ? RECEIVED_REQUEST : RECEIVED_DAMAGED;
    }
    uint8_t content = byte;
    if (run == 0) {
        /* A code byte: how many bytes until the next zero. 0xff would mean a block without one: too long for us. */
        run = (uint8_t)(byte - 1);
        if (byte == 0xff)
            broken = true;
        if (!begun) {
            begun = true;
            crc = CRC_INIT;
            return RECEIVED_NOTHING;
        }
        content = 0;
    } else {
        run--;
    }
    if (length == sizeof frame_incoming) {
        broken = true;
    } else if (!broken) {
        frame_incoming.bytes[length++] = content;
        crc = crc_update_byte(crc, content);
    }
    return RECEIVED_NOTHING;
}
