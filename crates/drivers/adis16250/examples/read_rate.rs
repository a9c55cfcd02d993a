//! Set up a gyro and read it. The bus here is a stand-in that answers like a part at rest, so that the example runs
//! anywhere: `cargo run -p adis16250 --example read_rate`. On a board, hand the driver the SPI device of your HAL.

use std::convert::Infallible;

use adis16250::{Adis16250, Error, Filter, Range, Register, SensAvg};
use embedded_hal::delay::DelayNs;
use embedded_hal::spi::{ErrorType, Operation, SpiDevice};

/// Registers by address, and the reply that the next frame will carry.
struct Part {
    registers: [u16; 32],
    reply: u16,
}

impl ErrorType for Part {
    type Error = Infallible;
}

impl SpiDevice for Part {
    fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), Infallible> {
        for operation in operations {
            if let Operation::TransferInPlace(frame) = operation {
                let (address, value) = (frame[0] & 0x3F, frame[1]);
                let register = &mut self.registers[usize::from(address / 2)];
                let reply = self.reply;
                if frame[0] & 0x80 == 0 {
                    self.reply = *register;
                } else if address & 1 == 0 {
                    *register = *register & 0xFF00 | u16::from(value);
                } else {
                    *register = *register & 0x00FF | u16::from(value) << 8;
                }
                frame.copy_from_slice(&reply.to_be_bytes());
            }
        }
        Ok(())
    }
}

struct NoDelay;

impl DelayNs for NoDelay {
    fn delay_ns(&mut self, _: u32) {}
}

fn main() -> Result<(), Error<Infallible>> {
    let mut part = Part {
        registers: [0; 32],
        reply: 0,
    };
    part.registers[0x04 / 2] = 0x8000 | 12; // GYRO_OUT: new, 12 counts
    part.registers[0x0C / 2] = 0x8000 | 40; // TEMP_OUT: new, 40 counts
    part.registers[0x36 / 2] = 0x0001; // SMPL_PRD: 256 SPS

    let mut delay = NoDelay;
    let mut gyro = Adis16250::new(part);
    let period = gyro.sample_period(&mut delay)?;
    let setting = SensAvg::new(Range::Dps80, Filter::Taps4); // becomes 16 taps: the range needs them
    gyro.set_range(setting, &mut delay)?;

    let rate = gyro.read(Register::GyroOut, &mut delay)?;
    let temperature = gyro.read(Register::TempOut, &mut delay)?;
    println!(
        "a sample every {} µs, {} taps",
        period.micros(),
        setting.filter().taps()
    );
    println!("new: {}, error: {}", rate.is_new(), rate.has_error());
    println!(
        "{} µdeg/s at {} µdegC",
        rate.rate().micro_dps(setting.range()),
        temperature.temperature().micro_celsius()
    );
    Ok(())
}
