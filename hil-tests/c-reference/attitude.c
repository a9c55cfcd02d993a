#include "attitude.h"

#include <stddef.h>
#include <string.h>

#include "maths.h"

/* Half of the angle that a rate of 1 deg/s makes in a timer tick of 4 us, rad: Q55. A third, Q32. A length of 1, Q28. */
#define HALF_TICK 1257642267L
#define THIRD 0x55555555L
#define LENGTH (1L << 28)
#define ACC_ZERO 512

/* The places of the numbers: q; scratch; half angles behind a cell that is for the length; rates, then the acceleration; a number
 * of its own, which as the second factor stands for 1. */
enum { Q = 0, T = 4, H = 8, V = 12, K = 15 };

/* To a cell is added the product of two others over 2^32, or it is taken off: see the Rust image's src/attitude.rs. */
#define ADD(to, a, b) ((to) << 8 | (a) << 4 | (b))
#define LESS(to, a, b) (0x8000U | ADD(to, a, b))
#define DOUBLE(cell) ADD(cell, cell, K)
#define CLEAR(cell) LESS(cell, cell, K)

static const __flash uint16_t angles[] = {
    ADD(T + 1, K, T),
    DOUBLE(T + 1), DOUBLE(T + 1), DOUBLE(T + 1), DOUBLE(T + 1),
    ADD(H + 1, V, T + 1),
    DOUBLE(H + 1), DOUBLE(H + 1), DOUBLE(H + 1),
    ADD(H + 2, V + 1, T + 1),
    DOUBLE(H + 2), DOUBLE(H + 2), DOUBLE(H + 2),
    ADD(H + 3, V + 2, T + 1),
    DOUBLE(H + 3), DOUBLE(H + 3), DOUBLE(H + 3),
};

static const __flash uint16_t lean[] = {
    CLEAR(T + 1), ADD(T + 1, Q + 1, Q + 3), LESS(T + 1, Q, Q + 2),
    ADD(T + 2, Q + 2, Q + 3), ADD(T + 2, Q, Q + 1),
    LESS(T + 3, Q + 1, Q + 1), LESS(T + 3, Q + 2, Q + 2),
    ADD(H + 1, V + 1, T + 3), LESS(H + 1, V + 2, T + 2),
    ADD(H + 2, V + 2, T + 1), LESS(H + 2, V, T + 3),
    ADD(H + 3, V, T + 2), LESS(H + 3, V + 1, T + 1),
};

static const __flash uint16_t turn[] = {
    CLEAR(T), ADD(T, K, H + 1), LESS(H, T, H + 1),
    CLEAR(T), ADD(T, K, H + 2), LESS(H, T, H + 2),
    CLEAR(T), ADD(T, K, H + 3), LESS(H, T, H + 3),
    CLEAR(T), ADD(T, Q, K), ADD(T, Q, H),
    LESS(T, Q + 1, H + 1), LESS(T, Q + 2, H + 2), LESS(T, Q + 3, H + 3),
    CLEAR(T + 1), ADD(T + 1, Q + 1, K), ADD(T + 1, Q + 1, H),
    ADD(T + 1, Q, H + 1), ADD(T + 1, Q + 2, H + 3), LESS(T + 1, Q + 3, H + 2),
    CLEAR(T + 2), ADD(T + 2, Q + 2, K), ADD(T + 2, Q + 2, H),
    ADD(T + 2, Q, H + 2), LESS(T + 2, Q + 1, H + 3), ADD(T + 2, Q + 3, H + 1),
    CLEAR(T + 3), ADD(T + 3, Q + 3, K), ADD(T + 3, Q + 3, H),
    ADD(T + 3, Q, H + 3), ADD(T + 3, Q + 1, H + 2), LESS(T + 3, Q + 2, H + 1),
    CLEAR(H), ADD(H, V, K),
    LESS(H, T, T), LESS(H, T + 1, T + 1), LESS(H, T + 2, T + 2), LESS(H, T + 3, T + 3),
    DOUBLE(H), DOUBLE(H), DOUBLE(H),
    CLEAR(Q), ADD(Q, T, K), ADD(Q, T, H),
    CLEAR(Q + 1), ADD(Q + 1, T + 1, K), ADD(Q + 1, T + 1, H),
    CLEAR(Q + 2), ADD(Q + 2, T + 2, K), ADD(Q + 2, T + 2, H),
    CLEAR(Q + 3), ADD(Q + 3, T + 3, K), ADD(Q + 3, T + 3, H),
};

static void run(int32_t cells[16], const __flash uint16_t *steps, uint8_t count)
{
    for (; count; count--) {
        uint16_t step = *steps++;
        uint8_t b = step & 15;
        uint32_t term = (uint32_t)cells[step >> 4 & 15];
        if (b != K)
            term = (uint32_t)mul((int32_t)term, cells[b]);
        if (step & 0x8000)
            term = -term;
        uint32_t *to = (uint32_t *)&cells[step >> 8 & 15];
        *to += term;
    }
}

#define RUN(cells, steps) run(cells, steps, sizeof steps / sizeof *steps)

void attitude_begin(int32_t q[4])
{
    memset(q, 0, 4 * sizeof *q);
    q[0] = 1L << 30;
}

void attitude_step(int32_t q[4], const int32_t rate[3], uint16_t ticks, const uint16_t *acc)
{
    int32_t cells[16] = {0};
    memcpy(cells + Q, q, 4 * sizeof *q);
    memcpy(cells + V, rate, 3 * sizeof *rate);
    cells[K] = (int32_t)ticks << 14;
    cells[T] = HALF_TICK;
    RUN(cells, angles);
    if (acc != NULL) {
        for (uint8_t i = 0; i < 3; i++)
            cells[V + i] = (int32_t)((uint32_t)((acc[i] - ACC_ZERO) << 6) << 16);
        cells[T + 3] = LENGTH / 2;
        RUN(cells, lean);
    }
    cells[K] = THIRD;
    cells[V] = LENGTH;
    RUN(cells, turn);
    memcpy(q, cells + Q, 4 * sizeof *q);
}
