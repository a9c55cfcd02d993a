#!/usr/bin/env python3
"""Byte vectors of the wire format, written from docs/wire-format.md alone: no code of the crate is used.

    python3 crates/wire/testdata/vectors.py > crates/wire/testdata/vectors.hex

The CRC is computed by the definition, bit by bit, most significant bit first on reversed bytes (the crate shifts the
other way); COBS by splitting at the zeros. Each line is `name: bytes on the line`.
"""

import struct


def crc32c(data):
    register = 0xFFFFFFFF
    for byte in data:
        for bit in range(8):
            bit_in = byte >> bit & 1
            top = register >> 31
            register = register << 1 & 0xFFFFFFFF
            if top ^ bit_in:
                register ^= 0x1EDC6F41
    return int(f"{register:032b}"[::-1], 2) ^ 0xFFFFFFFF


assert crc32c(b"123456789") == 0xE3069283  # the published check value


def line(kind, fmt, *fields):
    payload = bytes([1, kind]) + struct.pack("<" + fmt, *fields)
    body = payload + struct.pack("<I", crc32c(payload))
    blocks = body.split(b"\0")
    assert all(len(block) < 254 for block in blocks)
    return b"".join(bytes([len(block) + 1]) + block for block in blocks) + b"\0"


def request(number, code, fmt, *arguments):
    data = struct.pack("<" + fmt, *arguments)
    return line(0x10, "HB8s", number, code, data.ljust(8, b"\0"))


SAMPLE = "HI3h3hH3HhH3i"
HELLO = "3BHBHHIHH5B3i3iB"
HEALTH = "IHHH36H"
REPLY = "HBBi3i"
CORRECTED = "H3i3i3HHB"

vectors = {
    "sample_zero": line(2, SAMPLE, *[0] * 17),
    "sample_in_order": line(
        2, SAMPLE, 0x1234, 0x01020304, -1, 4368, -8192, -447, 0, 413, 2730, 512, 511, 760, -200, 7,
        -4801, 20971499, -(1 << 31)),
    "hello": line(
        1, HELLO, 1, 2, 3, 0xBEEF, 0x09, 5, 0, 4000, 12500, 25, 4, 2, 1, 0, 1,
        65536, -32768, 0, 1229099, 614549, 307275, 3),
    "health": line(3, HEALTH, 86400, 0xFFFF, 12499, 300, *range(0, 36 * 1000, 1000)),
    "health_saturated": line(3, HEALTH, 0xFFFFFFFF, 0, 0, 0, *[65535] * 36),
    "reply_ok": line(4, REPLY, 258, 1, 0, 0, 0, 0, 0),
    "reply_bias_null": line(4, REPLY, 65535, 32, 0, 120, 65536, -65536, 1),
    "reply_moving": line(4, REPLY, 2, 32, 5, 0, 0, 0, 0),
    "corrected": line(5, CORRECTED, 0x1234, 1048576, -1, 0, -524288, 7, 0, 256, 65535, 0, 0xBEEF, 0x27),
    "corrected_attitude": line(5, CORRECTED + "4i", 0x1234, 1048576, -1, 0, -524288, 7, 0, 256, 65535, 0, 0xBEEF, 0xA7,
                               1 << 30, -1, 0x01020304, -(1 << 31)),
    "request_set_correction": request(29, 35, "B3h", 17, -32768, 32767, 258),
    "request_correction": request(30, 36, "B", 1),
    "request_get_correction": request(31, 37, "BB", 1, 12),
    "request_ping": request(1, 1, ""),
    "request_keep_alive": request(0x0203, 3, ""),
    "request_set_rate": request(7, 16, "HB", 62500, 4),
    "request_set_baud": request(8, 17, "H", 3),
    "request_set_gyro": request(9, 18, "BB", 1, 4),
    "request_set_acc_range": request(10, 19, "B", 3),
    "request_bias_null": request(11, 32, "H", 200),
    "request_set_bias": request(12, 33, "Bi", 2, -65536),
    "request_set_scale": request(13, 34, "Bi", 1, 1229099),
    "request_motor_duty": request(14, 48, "h", -255),
    "request_motor_profile": request(15, 49, "BhhHB", 3, 200, -20, 1500, 4),
    "request_motor_limits": request(16, 50, "BH", 200, 500),
    "request_arm": request(28, 51, "H", 0xA55A),
    "request_read_register": request(17, 64, "BB", 0, 0x38),
    "request_write_register": request(18, 65, "BBH", 1, 0x38, 0x0402),
    "request_self_test": request(19, 66, "B", 3),
    "request_set_board_id": request(20, 83, "H", 0xBEEF),
    "request_get_hello": request(21, 2, ""),
    "request_counters": request(22, 4, ""),
    "request_clear_counters": request(23, 5, ""),
    "request_reboot": request(24, 6, ""),
    "request_store_config": request(25, 80, ""),
    "request_load_config": request(26, 81, ""),
    "request_default_config": request(27, 82, ""),
}

for name, data in vectors.items():
    print(f"{name}: {data.hex()}")
