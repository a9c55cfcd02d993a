//! Set the range and read the three outputs: `cargo run -p mma7260qt --example read_acceleration`. Pins and converter
//! here are stand-ins, so that the example runs anywhere; on a board, hand over those of your HAL.

use std::convert::Infallible;

use embedded_hal::digital::{ErrorType, OutputPin};
use mma7260qt::{Axis, Mma7260qt, Range, Scale, WAKE_US, acceleration};

struct Pin(&'static str);

impl ErrorType for Pin {
    type Error = Infallible;
}

impl OutputPin for Pin {
    fn set_low(&mut self) -> Result<(), Infallible> {
        println!("{} low", self.0);
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Infallible> {
        println!("{} released", self.0);
        Ok(())
    }
}

fn main() {
    const SCALE: Scale = Scale::ratiometric(Range::G2, 10);
    let part = Mma7260qt::new(Pin("g-select1"), Pin("g-select2"), Pin("sleep"), Range::G2);
    let Ok(_part) = part;
    println!("wait {WAKE_US} µs");
    let mut converter = |axis| Ok::<u16, Infallible>(if axis == Axis::Z { 698 } else { 513 });
    let Ok([x, y, z]) = acceleration(&mut converter, &SCALE);
    println!("x {x} µg, y {y} µg, z {z} µg");
}
