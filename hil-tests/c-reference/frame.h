/* Frames on the line: COBS(payload ++ CRC-32C) ++ 00. */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#include "wire.h"

#define CRC_INIT 0xffffffffUL
/* The register after a message and its CRC. */
#define CRC_RESIDUE 0xb798b438UL

/* The CRC's register after `length` more bytes. */
uint32_t crc_update_byte(uint32_t crc, uint8_t byte);
uint32_t crc_update(uint32_t crc, const void *bytes, uint8_t length);

/* Queues a payload, which begins with its header; false, and nothing queued, when there is no room. */
bool frame_send(uint8_t kind, void *payload, uint8_t length);

enum received { RECEIVED_NOTHING, RECEIVED_REQUEST, RECEIVED_DAMAGED };

/* Takes a byte from the line; after RECEIVED_REQUEST, frame_request holds until the next byte. */
enum received frame_receive(uint8_t byte);

extern union incoming {
    struct request request;
    uint8_t bytes[sizeof(struct request) + 4];
} frame_incoming;
