//! What went wrong on the board, counted.

macro_rules! faults {
    ($($(#[$doc:meta])* $name:ident = $number:literal, $text:literal;)*) => {
        /// Everything that the board counts. The discriminant is the counter's place in the health frame.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
        #[repr(u8)]
        pub enum Fault {
            $($(#[$doc])* $name = $number,)*
        }

        impl Fault {
            /// How many there are.
            pub const COUNT: usize = [$($number),*].len();

            /// All of them, in the order of the health frame.
            pub const fn all() -> [Fault; Fault::COUNT] {
                [$(Fault::$name),*]
            }

            /// The name as docs/wire-format.md has it.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self {
                    $(Fault::$name => $text,)*
                }
            }
        }
    };
}

faults! {
    /// The end of an SPI byte did not come within its budget.
    SpiStalled = 0, "spi_stalled";
    /// Gyro x had no new data (ND clear) at a tick.
    GyroStaleX = 1, "gyro_stale_x";
    /// Gyro y had no new data at a tick.
    GyroStaleY = 2, "gyro_stale_y";
    /// Gyro z had no new data at a tick.
    GyroStaleZ = 3, "gyro_stale_z";
    /// Gyro x raised its error/alarm bit (EA).
    GyroErrorAlarmX = 4, "gyro_error_alarm_x";
    /// Gyro y raised its error/alarm bit.
    GyroErrorAlarmY = 5, "gyro_error_alarm_y";
    /// Gyro z raised its error/alarm bit.
    GyroErrorAlarmZ = 6, "gyro_error_alarm_z";
    /// Gyro x answered all zeros or all ones.
    GyroNotAnsweringX = 7, "gyro_not_answering_x";
    /// Gyro y answered all zeros or all ones.
    GyroNotAnsweringY = 8, "gyro_not_answering_y";
    /// Gyro z answered all zeros or all ones.
    GyroNotAnsweringZ = 9, "gyro_not_answering_z";
    /// A configuration register of gyro x did not read back what was written.
    GyroRegisterMismatchX = 10, "gyro_register_mismatch_x";
    /// A configuration register of gyro y did not read back what was written.
    GyroRegisterMismatchY = 11, "gyro_register_mismatch_y";
    /// A configuration register of gyro z did not read back what was written.
    GyroRegisterMismatchZ = 12, "gyro_register_mismatch_z";
    /// GYRO_SCALE of gyro x is not what the part was calibrated to.
    GyroScaleImpossibleX = 13, "gyro_scale_impossible_x";
    /// GYRO_SCALE of gyro y is not what the part was calibrated to.
    GyroScaleImpossibleY = 14, "gyro_scale_impossible_y";
    /// GYRO_SCALE of gyro z is not what the part was calibrated to.
    GyroScaleImpossibleZ = 15, "gyro_scale_impossible_z";
    /// Gyro x was configured anew and answers again.
    GyroRecoveredX = 16, "gyro_recovered_x";
    /// Gyro y was configured anew and answers again.
    GyroRecoveredY = 17, "gyro_recovered_y";
    /// Gyro z was configured anew and answers again.
    GyroRecoveredZ = 18, "gyro_recovered_z";
    /// A conversion of the ADC did not end within its budget.
    AdcStalled = 19, "adc_stalled";
    /// Accelerometer output x read 0 or 1023.
    AccAtRailX = 20, "acc_at_rail_x";
    /// Accelerometer output y read 0 or 1023.
    AccAtRailY = 21, "acc_at_rail_y";
    /// Accelerometer output z read 0 or 1023.
    AccAtRailZ = 22, "acc_at_rail_z";
    /// The supply that a gyro measured was outside 4.75 V to 5.25 V.
    SupplyOutOfRange = 23, "supply_out_of_range";
    /// A tick came before the last one's work was done. One count for each sequence number that was spent without a
    /// sample.
    TickOverrun = 24, "tick_overrun";
    /// A sample did not fit into the transmit buffer. One count for each sequence number whose sample was not sent.
    FrameDropped = 25, "frame_dropped";
    /// A hello, health or reply frame did not fit into the transmit buffer.
    ReportDropped = 26, "report_dropped";
    /// A received byte was lost: overrun in the USART, or the receive buffer full.
    RxOverrun = 27, "rx_overrun";
    /// A received byte without a stop bit.
    RxFraming = 28, "rx_framing";
    /// A received frame with a wrong CRC, wrong stuffing or wrong length.
    RxBadFrame = 29, "rx_bad_frame";
    /// The motor was stopped because no keep-alive came.
    MotorTimeout = 30, "motor_timeout";
    /// A stored configuration failed its check and was not used.
    ConfigInvalid = 31, "config_invalid";
    /// Writing the configuration to EEPROM did not read back.
    ConfigNotStored = 32, "config_not_stored";
    /// The watchdog reset the board. Kept over resets, not over power loss.
    WatchdogReset = 33, "watchdog_reset";
    /// The supply sagged and the brown-out detector reset the board. Kept over resets, as far as SRAM survived.
    BrownOutReset = 34, "brown_out_reset";
    /// A health frame was made after the stack had had less than 32 bytes left.
    StackLow = 35, "stack_low";
}

impl Fault {
    /// [`GyroStaleX`](Fault::GyroStaleX) and its kin for axis 0, 1, 2. Any other axis counts as z.
    #[must_use]
    pub const fn gyro_stale(axis: u8) -> Fault {
        match axis {
            0 => Fault::GyroStaleX,
            1 => Fault::GyroStaleY,
            _ => Fault::GyroStaleZ,
        }
    }

    /// [`GyroErrorAlarmX`](Fault::GyroErrorAlarmX) and its kin for axis 0, 1, 2.
    #[must_use]
    pub const fn gyro_error_alarm(axis: u8) -> Fault {
        match axis {
            0 => Fault::GyroErrorAlarmX,
            1 => Fault::GyroErrorAlarmY,
            _ => Fault::GyroErrorAlarmZ,
        }
    }

    /// [`GyroNotAnsweringX`](Fault::GyroNotAnsweringX) and its kin for axis 0, 1, 2.
    #[must_use]
    pub const fn gyro_not_answering(axis: u8) -> Fault {
        match axis {
            0 => Fault::GyroNotAnsweringX,
            1 => Fault::GyroNotAnsweringY,
            _ => Fault::GyroNotAnsweringZ,
        }
    }

    /// [`GyroRegisterMismatchX`](Fault::GyroRegisterMismatchX) and its kin for axis 0, 1, 2.
    #[must_use]
    pub const fn gyro_register_mismatch(axis: u8) -> Fault {
        match axis {
            0 => Fault::GyroRegisterMismatchX,
            1 => Fault::GyroRegisterMismatchY,
            _ => Fault::GyroRegisterMismatchZ,
        }
    }

    /// [`GyroScaleImpossibleX`](Fault::GyroScaleImpossibleX) and its kin for axis 0, 1, 2.
    #[must_use]
    pub const fn gyro_scale_impossible(axis: u8) -> Fault {
        match axis {
            0 => Fault::GyroScaleImpossibleX,
            1 => Fault::GyroScaleImpossibleY,
            _ => Fault::GyroScaleImpossibleZ,
        }
    }

    /// [`GyroRecoveredX`](Fault::GyroRecoveredX) and its kin for axis 0, 1, 2.
    #[must_use]
    pub const fn gyro_recovered(axis: u8) -> Fault {
        match axis {
            0 => Fault::GyroRecoveredX,
            1 => Fault::GyroRecoveredY,
            _ => Fault::GyroRecoveredZ,
        }
    }

    /// [`AccAtRailX`](Fault::AccAtRailX) and its kin for axis 0, 1, 2.
    #[must_use]
    pub const fn acc_at_rail(axis: u8) -> Fault {
        match axis {
            0 => Fault::AccAtRailX,
            1 => Fault::AccAtRailY,
            _ => Fault::AccAtRailZ,
        }
    }
}

/// One counter for each [`Fault`]. Counts saturate: 65535 reads "at least 65535".
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FaultCounts(pub(crate) [u16; Fault::COUNT]);

impl Default for FaultCounts {
    fn default() -> Self {
        FaultCounts::new()
    }
}

impl FaultCounts {
    /// All zero.
    #[must_use]
    pub const fn new() -> Self {
        FaultCounts([0; Fault::COUNT])
    }

    /// Counts `fault` once more.
    #[inline(never)]
    pub fn record(&mut self, fault: Fault) {
        self.record_many(fault, 1);
    }

    /// Counts `fault` `times` more.
    #[inline(never)]
    pub fn record_many(&mut self, fault: Fault, times: u16) {
        // The discriminants are 0 .. COUNT without a gap (the array `all` would not fit otherwise, and a test holds
        // it to that), so there always is a counter; asking for it this way keeps a panic out of the image.
        if let Some(count) = self.0.get_mut(fault as usize) {
            *count = count.saturating_add(times);
        }
    }

    /// The count of `fault`.
    #[must_use]
    pub fn get(&self, fault: Fault) -> u16 {
        self.0.get(fault as usize).copied().unwrap_or(0)
    }

    /// Sets the count of `fault`, as for counts that outlive a reset.
    pub fn set(&mut self, fault: Fault, count: u16) {
        if let Some(place) = self.0.get_mut(fault as usize) {
            *place = count;
        }
    }

    /// Every fault with its count, in the order of the health frame.
    pub fn iter(&self) -> impl Iterator<Item = (Fault, u16)> + '_ {
        Fault::all().into_iter().zip(self.0)
    }
}

/// Health frame: is the board well, and what has gone wrong since it started.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Health {
    /// Time since the last reset, s.
    pub uptime_s: u32,
    /// The sequence number that the next tick's sample will have. Samples with smaller numbers were sent before this
    /// frame or are lost, and then counted as [`Fault::FrameDropped`] or [`Fault::TickOverrun`] below.
    pub next_seq: u16,
    /// The longest that one tick's work has taken since the last reset, in timer ticks ([`Hello::tick_ns`]).
    ///
    /// [`Hello::tick_ns`]: crate::Hello::tick_ns
    pub tick_busy_max: u16,
    /// The least stack that was ever left since the last reset, bytes.
    pub stack_free: u16,
    /// What went wrong, counted.
    pub faults: FaultCounts,
}

impl Health {
    /// Bytes of the payload, version and kind included.
    pub const LEN: usize = 2 + size_of::<crate::fields::Health>();
    /// Bytes on the line.
    pub const FRAME_LEN: usize = Self::LEN + crate::OVERHEAD;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_fault_has_a_counter_of_its_own() {
        for (place, fault) in Fault::all().into_iter().enumerate() {
            assert_eq!(fault as usize, place);
            let mut counts = FaultCounts::new();
            counts.record(fault);
            assert!(
                counts
                    .iter()
                    .all(|(other, count)| count == u16::from(other == fault))
            );
        }
    }

    #[test]
    fn counts_saturate() {
        let mut counts = FaultCounts::new();
        counts.set(Fault::SpiStalled, 65_534);
        for _ in 0..3 {
            counts.record(Fault::SpiStalled);
        }
        assert_eq!(counts.get(Fault::SpiStalled), 65_535);
    }

    #[test]
    fn the_faults_of_an_axis_are_named_for_it() {
        for (axis, letter) in ["_x", "_y", "_z"].into_iter().enumerate() {
            let axis = axis as u8;
            for fault in [
                Fault::gyro_stale(axis),
                Fault::gyro_error_alarm(axis),
                Fault::gyro_not_answering(axis),
                Fault::gyro_register_mismatch(axis),
                Fault::gyro_scale_impossible(axis),
                Fault::gyro_recovered(axis),
                Fault::acc_at_rail(axis),
            ] {
                assert!(
                    fault.name().ends_with(letter),
                    "{} for axis {axis}",
                    fault.name()
                );
            }
        }
    }
}
