//! No bytes make the reader panic.

use proptest::prelude::*;

use super::*;

/// Pieces that tables are made of, right and wrong.
fn piece() -> impl Strategy<Value = Vec<u8>> {
    let known = [
        "# rate_hz: 20\n",
        "# format: imu-stand-capture/1\n",
        "# gyro_lsb_dps: 0.07\n",
        "#t,x\n",
        "sep=;\n",
        "time",
        "gyro_x",
        "gyro_y (rad/s)",
        "seq",
        "t_ticks",
        "flags",
        ",",
        ";",
        "\t",
        " ",
        "\n",
        "\r\n",
        "1",
        "-2.5",
        "1e308",
        "4294967296",
        "99999999999999999999",
        "-9223372036854775808",
        "9223372036854775807",
        "nan",
        "inf",
        "\"",
        "''",
        "[ns]",
        "2014-06-24 19:02:59.78",
        "s,deg/s\n",
        "\u{feff}",
        "°",
        "%",
        "(",
        ")",
    ];
    prop_oneof![
        8 => prop::sample::select(known.to_vec()).prop_map(|text| text.as_bytes().to_vec()),
        1 => prop::collection::vec(any::<u8>(), 0..12),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn no_bytes_make_the_reader_panic(
        pieces in prop::collection::vec(piece(), 0..60),
        mapping in prop::sample::select(vec![
            ("", ""), ("", "gyro=deg/s"), ("gyro_x=1", "gyro=deg"), ("time=1,gyro_x=2", "time=ns"),
        ]),
        skip_bad in any::<bool>(),
    ) {
        let bytes = pieces.concat();
        let mut options = options(mapping.0, mapping.1).expect("a mapping");
        options.skip_bad = skip_bad;
        if let Ok(read) = read_from(&bytes[..], &options) {
            let rows = read.record.len();
            for channel in &read.record.channels {
                prop_assert_eq!(channel.values.len(), rows);
            }
        }
    }
}
