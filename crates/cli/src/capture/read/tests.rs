use super::*;

const OURS: &str = "# format: imu-stand-capture/1\n# rate_hz: 20\n# tick_s: 4e-6\n# gyro_lsb_dps: 0.07326\n\
    # base: static\nseq,t_ticks,gyro_z,flags\n65534,4294960000,14,7\n65535,4294962500,-2,7\n0,5204,,7\n";

fn read(text: &str) -> Result<Read, CaptureError> {
    read_from(text.as_bytes(), &ReadOptions::default())
}

#[test]
fn counters_are_unwrapped_and_counts_scaled() {
    let record = read(OURS).unwrap().record;
    assert_eq!(record.seq, Some(vec![65_534, 65_535, 65_536]));
    assert_eq!(record.t_ticks.unwrap()[2], 4_294_972_500);
    let gyro = &record.channels[0];
    assert!((gyro.values[0] - 14.0 * 0.07326).abs() < 1e-12);
    assert!(gyro.values[2].is_nan(), "an empty cell is no value");
}

#[test]
fn a_missing_key_is_named() {
    let text = OURS.replace("# gyro_lsb_dps: 0.07326\n", "");
    let error = read(&text).unwrap_err().to_string();
    assert!(
        error.contains("gyro_lsb_dps") && error.contains("gyro_z"),
        "{error}"
    );
}

#[test]
fn a_corrupt_row_is_named_by_line_or_left_out_and_counted() {
    let text = OURS.replace("65535,4294962500,-2,7", "65535,4294962500,-2x,7");
    let error = read(&text).unwrap_err().to_string();
    assert!(error.starts_with("line 8, column `gyro_z`"), "{error}");
    let options = ReadOptions {
        skip_bad: true,
        ..ReadOptions::default()
    };
    let read = read_from(text.as_bytes(), &options).unwrap();
    // It came, and has its place; what it read is not known.
    assert_eq!((read.skipped, read.record.len()), (1, 3));
    assert_eq!(read.record.seq, Some(vec![65_534, 65_535, 65_536]));
    assert!(read.record.channels[0].values[1].is_nan());
}

#[test]
fn a_foreign_file_without_mapping_is_told_how_to_map_it() {
    let text = "# a note: of theirs\ntime_s,gx,gy,gz,ax\n0,1,2,3,4\n";
    let error = read(text).unwrap_err();
    let help = miette::Diagnostic::help(&error).unwrap().to_string();
    assert!(
        help.contains("time=time_s,gyro_x=gx,gyro_y=gy,gyro_z=gz,acc_x=ax"),
        "{help}"
    );
    // A name that says another unit than the mapping is told.
    let text = text.replace("gx", "gx_dps");
    let mapping =
        ColumnMapping::parse(Some("time=time_s,gyro_x=gx_dps"), Some("gyro=rad/s")).unwrap();
    let read = read_from(
        text.as_bytes(),
        &ReadOptions {
            mapping,
            ..ReadOptions::default()
        },
    )
    .unwrap();
    assert!(read.record.notes[0].contains("says deg/s"));
    assert!((read.record.channels[0].values[0] - 57.295_779_5).abs() < 1e-6);
}

#[test]
fn what_is_said_of_the_base_is_known_before_anything_is_noted() {
    let base = |base| {
        let options = ReadOptions {
            base,
            ..ReadOptions::default()
        };
        let read = read_from(OURS.as_bytes(), &options).unwrap();
        read.record.header.base
    };
    assert_eq!(base(None), Some(Base::Static));
    assert_eq!(base(Some(Base::Moving)), Some(Base::Moving));
}

#[test]
fn of_a_base_that_moves_by_option_no_turn_is_noted() {
    let mut text = String::from("time_s,gyro_x [deg/s],acc_x [g],acc_y [g],acc_z [g]\n");
    for i in 0..1000 {
        let noise = f64::from(i * 7919 % 1000) * 1e-4;
        let (y, z) = if i < 500 { (0.0, 1.0) } else { (1.0, 0.0) };
        text += &format!(
            "{},{noise},{noise},{},{}\n",
            f64::from(i) * 0.01,
            y + noise,
            z + noise
        );
    }
    let turned = |base| {
        let options = ReadOptions {
            base,
            ..ReadOptions::default()
        };
        let notes = read_from(text.as_bytes(), &options).unwrap().record.notes;
        notes.iter().any(|n| n.contains("turned against gravity"))
    };
    assert!(turned(None));
    assert!(!turned(Some(Base::Moving)));
}
