/* The ADIS16250's registers, and work on them in the slot after a sample. */
#pragma once

#include <stdbool.h>
#include <stdint.h>

enum gyro_register {
    ENDURANCE = 0x00,
    SUPPLY_OUT = 0x02,
    GYRO_OUT = 0x04,
    TEMP_OUT = 0x0c,
    GYRO_OFF = 0x14,
    GYRO_SCALE = 0x16,
    ALM_CTRL = 0x28,
    MSC_CTRL = 0x34,
    SMPL_PRD = 0x36,
    SENS_AVG = 0x38,
    GYRO_STATUS = 0x3c,
    GYRO_COMMAND = 0x3e,
};

#define MSC_SELF_TEST (1 << 10)
#define GYRO_STATUS_SELF_TEST_FAILED (1 << 5)

struct gyro_job {
    enum { JOB_READ, JOB_WRITE, JOB_CONFIGURE } what;
    uint8_t axis;
    uint8_t address;
    uint16_t value; /* to write; afterwards what it reads, or for JOB_CONFIGURE a bit per axis that reads wrong */
    uint8_t status; /* afterwards */
};

void gyro_work(struct gyro_job *job);
/* SMPL_PRD of 256 samples a second. */
#define GYRO_FASTEST 1
/* Sets all three up and reads back; bits 0..2 for each axis that does not read as written, bits 3..5 for each whose
 * GYRO_SCALE is not what the part was calibrated to. */
uint8_t gyro_configure_all(uint16_t sens_avg);
