/* A word for a person at a terminal: `?` at the start of a line is answered in plain text. */
#pragma once

#include <stdbool.h>
#include <stdint.h>

/* Sees every received byte first; whether it was a question, which then has been answered. */
bool console_takes(uint8_t byte);
