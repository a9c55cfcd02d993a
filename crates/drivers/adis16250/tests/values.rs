//! Bits, codes and units, written out once more from the data sheet's tables.

use adis16250::{
    Alarm, AlarmOutput, AlarmSource, AngleCounts, AuxCounts, Command, DataReady, Filter, GpioCtrl,
    Line, LineUse, OffsetCounts, Pace, Polarity, Range, RateCounts, Register, SamplePeriod,
    SensAvg, Status, Stimulus, SupplyCounts, TemperatureCounts, Trigger, Word,
};

#[test]
fn ranges_and_filters_have_their_codes_and_what_goes_with_them() {
    for code in 0..=255u8 {
        let range = match code {
            1 => Some(Range::Dps80),
            2 => Some(Range::Dps160),
            4 => Some(Range::Dps320),
            _ => None,
        };
        assert_eq!(Range::from_code(code), range, "{code}");
        let filter = Filter::from_code(code);
        assert_eq!(
            filter.map(|filter| filter as u8),
            (code <= 6).then_some(code)
        );
        if let Some(filter) = filter {
            assert_eq!(filter.taps(), [1, 2, 4, 8, 16, 32, 64][usize::from(code)]);
            assert_eq!(filter.delay_samples(), filter.taps() - 1);
        }
    }
    for (range, micro, q24, shortest) in [
        (Range::Dps320, 73_260, 1_229_099, Filter::Taps1),
        (Range::Dps160, 36_630, 614_549, Filter::Taps4),
        (Range::Dps80, 18_315, 307_275, Filter::Taps16),
    ] {
        assert_eq!(range.micro_dps_per_count(), micro);
        assert_eq!(
            (range.scale_q24(), range.shortest_filter()),
            (q24, shortest)
        );
        for code in 0..=6 {
            let filter = Filter::from_code(code).expect("a code");
            let set = SensAvg::new(range, filter);
            assert_eq!((set.range(), set.filter()), (range, filter.max(shortest)));
            let bits = u16::from(range as u8) << 8 | u16::from(filter as u8);
            let read = SensAvg::from_bits(bits);
            assert_eq!(
                read.map(SensAvg::bits),
                (filter >= shortest).then_some(bits)
            );
        }
    }
    assert_eq!(SensAvg::default().bits(), 0x0402);
    assert_eq!(
        (SensAvg::from_bits(0x0302), SensAvg::from_bits(0x0407)),
        (None, None)
    );
}

#[test]
fn sample_periods_have_their_time_and_pace() {
    assert_eq!(SamplePeriod::default(), SamplePeriod::SPS_256);
    assert_eq!(SamplePeriod::from_bits(0), None);
    for (bits, micros, pace) in [
        (0x01, 3_906, Pace::Fast),
        (0x07, 15_625, Pace::Fast),
        (0x08, 17_578, Pace::Normal),
        (0x7f, 250_000, Pace::Normal),
        (0x80, 60_546, Pace::Normal),
        (0x81, 121_093, Pace::Normal),
        (0xff, 7_750_000, Pace::Normal),
    ] {
        let period = SamplePeriod::from_bits(bits).expect("not 0");
        assert_eq!(
            (period.bits(), period.micros(), period.pace()),
            (bits, micros, pace)
        );
    }
    assert_eq!(
        (Pace::Fast.clock_max_hz(), Pace::Fast.pause_us()),
        (2_500_000, 40)
    );
    assert_eq!(
        (Pace::Normal.clock_max_hz(), Pace::Normal.pause_us()),
        (1_000_000, 100)
    );
}

#[test]
fn stimuli_lines_and_alarms_have_their_bits() {
    let response = |stimulus: Stimulus, range| {
        let (least, most) = stimulus.response(range);
        (least.0, most.0)
    };
    for (range, times) in [(Range::Dps320, 1), (Range::Dps160, 2), (Range::Dps80, 4)] {
        assert_eq!(response(Stimulus::None, range), (0, 0));
        assert_eq!(
            response(Stimulus::Positive, range),
            (439 * times, 1_092 * times)
        );
        assert_eq!(
            response(Stimulus::Negative, range),
            (-1_092 * times, -439 * times)
        );
    }
    let bits = [Stimulus::None, Stimulus::Positive, Stimulus::Negative].map(Stimulus::bits);
    assert_eq!(bits, [0, 1, 2]);
    let ready = |line, polarity| DataReady { line, polarity }.bits();
    assert_eq!(ready(Line::Dio0, Polarity::ActiveLow), 0b100);
    assert_eq!(ready(Line::Dio1, Polarity::ActiveLow), 0b101);
    assert_eq!(ready(Line::Dio0, Polarity::ActiveHigh), 0b110);
    assert_eq!(ready(Line::Dio1, Polarity::ActiveHigh), 0b111);
    let output = |filtered, line| AlarmOutput { filtered, line }.bits();
    assert_eq!((output(false, None), output(true, None)), (0, 16));
    assert_eq!(
        output(false, Some((Line::Dio0, Polarity::ActiveLow))),
        0b100
    );
    assert_eq!(
        output(true, Some((Line::Dio1, Polarity::ActiveLow))),
        0b1_0101
    );
    assert_eq!(
        output(false, Some((Line::Dio0, Polarity::ActiveHigh))),
        0b110
    );
    assert_eq!(
        output(true, Some((Line::Dio1, Polarity::ActiveHigh))),
        0b1_0111
    );
    let uses = [LineUse::Input, LineUse::Low, LineUse::High];
    for (a, of_a) in uses.into_iter().zip([0, 0x001, 0x101]) {
        for (b, of_b) in uses.into_iter().zip([0, 0x002, 0x202]) {
            let set = GpioCtrl::new(a, b);
            assert_eq!(set.0, of_a | of_b);
            assert_eq!(
                (set.is_output(Line::Dio0), set.is_high(Line::Dio0)),
                (of_a & 1 != 0, of_a >> 8 != 0)
            );
            assert_eq!(
                (set.is_output(Line::Dio1), set.is_high(Line::Dio1)),
                (of_b & 2 != 0, of_b >> 8 != 0)
            );
        }
    }
    let alarm = |above, threshold, trigger| Alarm {
        source: AlarmSource::Rate,
        trigger,
        above,
        threshold,
    };
    assert_eq!(alarm(true, -1, Trigger::Level).magnitude_bits(), 0xbfff);
    assert_eq!(alarm(false, 300, Trigger::Level).magnitude_bits(), 300);
    assert_eq!(alarm(false, 0, Trigger::Level).samples_bits(), 0);
    assert_eq!(
        alarm(false, 0, Trigger::Change { samples: 9 }).samples_bits(),
        9
    );
}

#[test]
fn words_hold_fourteen_or_twelve_bits_and_two_flags() {
    for (bits, signed_14, signed_12, unsigned_12) in [
        (0x0000, 0, 0, 0),
        (0x1fff, 8191, -1, 0xfff),
        (0x2000, -8192, 0, 0),
        (0x3fff, -1, -1, 0xfff),
        (0x07ff, 2047, 2047, 2047),
        (0x0800, 2048, -2048, 2048),
        (0xd5a5, 0x15a5, 0x5a5, 0x5a5),
    ] {
        let word = Word(bits);
        assert_eq!(Word::from_bytes([(bits >> 8) as u8, bits as u8]), word);
        assert_eq!(word.bits(), bits);
        assert_eq!(
            (word.is_new(), word.has_error()),
            (bits & 0x8000 != 0, bits & 0x4000 != 0)
        );
        assert_eq!(
            (word.signed_14(), word.signed_12()),
            (signed_14, signed_12),
            "{bits:#x}"
        );
        assert_eq!(
            (word.unsigned_14(), word.unsigned_12()),
            (bits & 0x3fff, unsigned_12)
        );
        assert_eq!(word.rate(), RateCounts(signed_14));
        assert_eq!(word.temperature(), TemperatureCounts(signed_12));
        assert_eq!(
            (word.supply(), word.aux()),
            (SupplyCounts(unsigned_12), AuxCounts(unsigned_12))
        );
        assert_eq!(word.angle(), AngleCounts(bits & 0x3fff));
    }
    for (bits, stuck) in [
        (0, true),
        (0xffff, true),
        (1, false),
        (0xfffe, false),
        (0x8000, false),
    ] {
        assert_eq!(Word(bits).is_stuck(), stuck, "{bits:#x}");
    }
}

#[test]
fn counts_have_the_units_of_the_data_sheet() {
    assert_eq!(RateCounts(-100).micro_dps(Range::Dps320), -7_326_000);
    assert_eq!(
        TemperatureCounts(-10).micro_celsius(),
        25_000_000 - 1_453_000
    );
    assert_eq!(SupplyCounts(2730).microvolts(), 4_999_995);
    assert_eq!(AuxCounts(4095).microvolts(), 2_499_997);
    assert_eq!(AngleCounts(100).micro_degrees(), 3_663_000);
    assert_eq!(OffsetCounts(-7).micro_dps(), -128_205);
    // 4.75 and 5.25 V.
    for (counts, inside) in [(2593, false), (2594, true), (2866, true), (2867, false)] {
        assert_eq!(SupplyCounts(counts).is_in_range(), inside, "{counts}");
    }
    for (counts, scale) in [
        (8191, 1_229_099),
        (-8192, 1_229_099),
        (1, 255),
        (-1, 256),
        (3, 4_194_303),
    ] {
        let exact = f64::from(counts) * f64::from(scale) / 256.0;
        let got = f64::from(RateCounts(counts).dps_q16(scale));
        assert!(
            (exact - got) >= 0.0 && (exact - got) < 1.0,
            "{counts} {scale}"
        );
    }
}

#[test]
fn each_bit_of_the_status_has_its_name() {
    let named = |bits: u16| {
        let status = Status(bits);
        [
            status.supply_low(),
            status.supply_high(),
            status.flash_failed(),
            status.spi_failed(),
            status.overrange(),
            status.self_test_failed(),
            status.alarm_1(),
            status.alarm_2(),
        ]
    };
    for (place, bit) in [0, 1, 2, 3, 4, 5, 8, 9].into_iter().enumerate() {
        let mut only = [false; 8];
        only[place] = true;
        assert_eq!(named(1 << bit), only, "{bit}");
        assert!(!Status(1 << bit).is_ok());
    }
    assert!(Status(0).is_ok() && Status(!0x033f).is_ok());
    assert_eq!(named(!0x033f), [false; 8]);
}

#[test]
fn commands_reach_the_registers_that_there_are() {
    let readable = [
        0x00, 0x02, 0x04, 0x0a, 0x0c, 0x0e, 0x14, 0x16, 0x20, 0x22, 0x24, 0x26, 0x28, 0x30, 0x32,
        0x34, 0x36, 0x38, 0x3a, 0x3c,
    ];
    let outputs = [0x00, 0x02, 0x04, 0x0a, 0x0c, 0x0e, 0x3c];
    for address in 0..=255u8 {
        let even = address & !1;
        let reads = address < 0x40 && readable.contains(&even);
        let read = Command::read_at(address).map(Command::bits);
        assert_eq!(read, reads.then_some(u16::from(even) << 8), "{address:#x}");
        let writes = reads && !outputs.contains(&even) || even == 0x3e;
        let write = Command::write_at(address, 0x5a).map(Command::bytes);
        assert_eq!(
            write,
            writes.then_some([0x80 | address, 0x5a]),
            "{address:#x}"
        );
        // The low byte first, whichever of the two addresses is given.
        let word = Command::write_word_at(address, 0x1234).map(|both| both.map(Command::bytes));
        let both = [[0x80 | even, 0x34], [0x81 | even, 0x12]];
        assert_eq!(word, writes.then_some(both), "{address:#x}");
    }
    assert_eq!(Command::read(Register::TempOut).bytes(), [0x0c, 0]);
    assert_eq!(Command::write_low(Register::SensAvg, 7).bytes(), [0xb8, 7]);
    assert_eq!(Command::write_high(Register::SensAvg, 4).bytes(), [0xb9, 4]);
}

#[test]
fn ref_scaling_points_of_the_data_sheet() {
    let near = |micro: i64, expected: i64, tolerance: i64| {
        assert!((micro - expected).abs() <= tolerance, "{micro}")
    };
    near(
        Word(4368).rate().micro_dps(Range::Dps320).into(),
        320_000_000,
        73_260,
    );
    near(
        Word(8192).rate().micro_dps(Range::Dps320).into(),
        -600_145_920,
        0,
    );
    near(Word(2730).supply().microvolts().into(), 5_000_000, 1_832);
    near(
        Word(0x0E41).temperature().micro_celsius().into(),
        -40_000_000,
        145_300,
    );
    near(
        Word(413).temperature().micro_celsius().into(),
        85_000_000,
        145_300,
    );
    near(Word(4095).aux().microvolts().into(), 2_500_000, 611);
    near(
        Word(9828).angle().micro_degrees().into(),
        360_000_000,
        36_630,
    );
    assert!(
        Word(2594).supply().is_in_range() && !Word(2593).supply().is_in_range(),
        "4.75 V"
    );
    assert!(
        Word(2866).supply().is_in_range() && !Word(2867).supply().is_in_range(),
        "5.25 V"
    );
}

#[test]
fn bits_of_the_twelve_bit_outputs_that_mean_nothing_are_dropped() {
    assert_eq!(Word(0xB000 | 0x0E41).temperature().0, -447);
    assert_eq!(Word(0xF000 | 2730).supply().0, 2730);
    assert_eq!(Word(0xC000 | 0x3FFF).rate().0, -1);
}

/// The fixed-point product against the same in 64 bits, for every code.
#[test]
fn q16_rates_are_the_exact_product_rounded_down() {
    for range in [Range::Dps320, Range::Dps160, Range::Dps80] {
        let scale = range.scale_q24();
        assert!(
            (i64::from(scale) * 1_000_000 - (i64::from(range.micro_dps_per_count()) << 24)).abs()
                <= 500_000
        );
        for code in 0..0x4000_u16 {
            let counts = Word(code).rate();
            let exact = (i64::from(counts.0) * i64::from(scale)) >> 8;
            assert_eq!(
                i64::from(counts.dps_q16(scale)),
                exact,
                "{counts:?} {range:?}"
            );
        }
    }
}
