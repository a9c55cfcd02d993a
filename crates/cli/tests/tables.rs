//! Files of arrays that others wrote: numpy 2 (`imu.npz`), scipy's savemat (`imu.mat`), hdf5storage's with one array
//! in compressed chunks by h5py (`imu73.mat`), pandas with pyarrow
//! (`imu.parquet`). 50 rows at 10 Hz of a gyro (k/2, −k/4, 2) deg/s, and what else such files hold: text, scalars, big-endian
//! integers, column order, nulls, row groups, stamps in nanoseconds.

use std::path::{Path, PathBuf};

use imu_stand::{ColumnMapping, ReadOptions, read_capture};
use model::record::Record;

fn data(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
        .join("tests/data")
        .join(name)
}

fn read(path: &Path, columns: &str, units: &str) -> Result<Record, String> {
    let some = |text: &str| (!text.is_empty()).then(|| text.to_owned());
    let mapping = ColumnMapping::parse(some(columns).as_deref(), some(units).as_deref())
        .map_err(|error| error.to_string())?;
    let options = ReadOptions {
        mapping,
        ..ReadOptions::default()
    };
    read_capture(path, &options)
        .map(|read| read.record)
        .map_err(|error| error.to_string())
}

fn values<'a>(record: &'a Record, name: &str) -> &'a [f64] {
    &record.channel(name).unwrap().values
}

#[test]
fn npz_and_mat_give_the_columns_of_their_matrices() {
    for name in ["imu.npz", "imu.mat", "imu73.mat"] {
        let columns = "time=t,gyro_x=gyr[0],gyro_y=gyr[1],gyro_z=gyr[2],acc_x=acc_raw";
        let record = read(&data(name), columns, "gyro=rad/s").unwrap();
        let degrees = 180.0 / std::f64::consts::PI;
        assert_eq!(record.len(), 50, "{name}");
        assert!(
            (values(&record, "gyro_x")[3] - 1.5 * degrees).abs() < 1e-9,
            "{name}"
        );
        assert!(
            (values(&record, "gyro_y")[49] + 12.25 * degrees).abs() < 1e-9,
            "{name}"
        );
        assert_eq!(values(&record, "acc_x")[49], 147.0, "{name}");
        assert!(
            (record.host_time_s.unwrap()[10] - 1.0).abs() < 1e-12,
            "{name}"
        );
    }
    // A scalar is a key of the header.
    for name in ["imu.npz", "imu73.mat"] {
        let record = read(&data(name), "gyro_x=gyr[0]", "gyro=rad/s").unwrap();
        assert_eq!(record.header.rate_hz, Some(10.0));
    }
    // A field of a struct.
    let record = read(
        &data("imu73.mat"),
        "gyro_x=gyr[0],temp=run.temp",
        "gyro=rad/s",
    )
    .unwrap();
    assert!((values(&record, "temp")[49] - 24.9).abs() < 1e-12);
}

/// `imu/gyro` of three columns in rad/s, `imu/time` in ms, by h5py: 50 rows.
#[test]
fn the_units_that_hdf5_states_are_taken() {
    let record = read(&data("units.h5"), "", "").unwrap();
    let x = values(&record, "gyro_x");
    assert!((x[3] - 3f64.to_degrees()).abs() < 1e-9, "{x:?}");
    let times = record.host_time_s.as_ref().expect("a time");
    assert!((times[10] - times[0] - 0.5).abs() < 1e-12, "{times:?}");
}

#[test]
fn a_file_that_was_cut_off_or_is_of_an_old_version_is_told_so() {
    let folder = folder_of("a_file_that_was_cut_off");
    let whole = std::fs::read(data("zstd.parquet")).unwrap();
    let path = folder.join("cut.parquet");
    std::fs::write(&path, &whole[..whole.len() / 2]).unwrap();
    let error = read(&path, "", "").unwrap_err();
    assert!(
        error.contains("begins as Parquet and does not end so"),
        "{error}"
    );
    // The head of a matrix of version 4: kind, rows, columns, no imaginary part, length of the name.
    let path = folder.join("old.mat");
    let head: Vec<u8> = [0_u32, 2, 1, 0, 2]
        .iter()
        .flat_map(|n| n.to_le_bytes())
        .collect();
    std::fs::write(&path, [&head[..], b"x\0", &[0; 16]].concat()).unwrap();
    let error = read(&path, "", "").unwrap_err();
    assert!(
        error.contains("version 4") && error.contains("-v7"),
        "{error}"
    );
}

#[test]
fn parquet_gives_nulls_as_missing_and_stamps_as_seconds() {
    let columns = "time=stamp,gyro_x=gx,gyro_y=gy,temp=temp";
    let record = read(&data("imu.parquet"), columns, "gyro=deg/s").unwrap();
    assert!(values(&record, "gyro_x")[7].is_nan());
    assert_eq!(values(&record, "gyro_x")[8], 4.0);
    assert_eq!(values(&record, "gyro_y")[45], -11.25);
    assert_eq!(values(&record, "temp")[49], 49.0);
    let times = record.host_time_s.unwrap();
    assert!(
        times[0] == 0.0 && (times[49] - 4.9).abs() < 1e-6,
        "{times:?}"
    );
}

/// 200 rows by pyarrow: nulls, floats of 32 bits, two row groups, data pages of version 1 and 2.
#[test]
fn every_codec_of_parquet_is_unpacked() {
    for codec in ["gzip", "zstd", "brotli", "lz4"] {
        let path = data(&format!("{codec}.parquet"));
        let columns = "time=t,gyro_x=gx,gyro_y=gy,count=n";
        let record = read(&path, columns, "gyro=deg/s").expect(codec);
        assert_eq!(record.len(), 200, "{codec}");
        let (x, y) = (values(&record, "gyro_x"), values(&record, "gyro_y"));
        assert!(x[7].is_nan() && x[6] == 3.0 && x[199] == 99.5, "{codec}");
        assert_eq!((y[121], y[119]), (1.0, 3.0), "{codec}");
        assert_eq!(values(&record, "count")[150], 150.0, "{codec}");
        // By what is in it: another ending is no other file.
        let other = folder_of("every_codec_of_parquet").join("table.dat");
        std::fs::copy(&path, &other).unwrap();
        assert_eq!(read(&other, columns, "gyro=deg/s").expect(codec).len(), 200);
    }
}

/// A column of the wrong length, a page that is damaged: an error with a reason, never a panic.
#[test]
fn a_damaged_page_is_refused() {
    let folder = folder_of("a_damaged_page_is_refused");
    for codec in ["gzip", "zstd", "brotli", "lz4"] {
        let bytes = std::fs::read(data(&format!("{codec}.parquet"))).unwrap();
        for at in (4..bytes.len() - 8).step_by(97) {
            let mut damaged = bytes.clone();
            damaged[at] ^= 0xff;
            let path = folder.join("damaged.parquet");
            std::fs::write(&path, damaged).unwrap();
            // Damage may lie where nothing is read.
            if let Err(error) = read(&path, "time=t,gyro_x=gx", "gyro=deg/s") {
                assert!(!error.is_empty());
            }
        }
    }
}

#[test]
fn what_cannot_be_read_is_named_with_what_there_is() {
    let error = read(&data("imu.parquet"), "", "").unwrap_err();
    assert!(error.contains("stamp, gx, gy, temp"), "{error}");
    let error = read(&data("imu.npz"), "gyro_x=gyr", "").unwrap_err();
    assert!(error.contains("gyr[0]"), "{error}");
    let folder = folder_of("what_cannot_be_read_is_named_with_what_there_is");
    for (name, text, expected) in [
        ("cut.npz", "PK", "it is no NPZ"),
        ("new.mat", "MATLAB 7.3 MAT-file, and so on", "-v7"),
        ("short.txt", "1 2\n3\n", "column_1, column_2"),
        ("none.txt", "# nothing\n", "no row of data"),
    ] {
        let path = folder.join(name);
        std::fs::write(&path, text).unwrap();
        let error = read(&path, "", "").unwrap_err();
        assert!(error.contains(expected), "{name}: {error}");
    }
    let error = read(&folder.join("short.txt"), "gyro_x=1", "gyro=deg/s").unwrap_err();
    assert!(
        error.contains("line 2 has 1 cells, and the table has 2 columns"),
        "{error}"
    );
}

#[test]
fn columns_of_text_and_angles_become_rates() {
    let folder = folder_of("columns_of_text_and_angles_become_rates");
    // One series without a name, as clock tools write it.
    let path = folder.join("frequency.txt");
    std::fs::write(&path, "# rate_hz: 2\n1.5e-3\n2.5e-3\n\n-1e-3\n").unwrap();
    let record = read(&path, "", "").unwrap();
    assert_eq!(values(&record, "values"), [1.5e-3, 2.5e-3, -1e-3]);
    assert_eq!(record.header.rate_hz, Some(2.0));
    // Angles: 1 rad in the first half second, a gap, 2 rad in the last.
    let path = folder.join("angle.dat");
    std::fs::write(&path, "t a\n0 0\n0.5 1\n2.0 9\n2.5 11\n3 12\n").unwrap();
    let record = read(&path, "time=t,gyro_z=a", "gyro=rad").unwrap();
    let gyro = record.channel("gyro_z").unwrap();
    let turn = 360.0 / std::f64::consts::PI;
    assert_eq!(gyro.unit, "deg/s");
    assert!((gyro.values[0] - turn).abs() < 1e-9 && gyro.values[1].is_nan());
    assert!((gyro.values[2] - 2.0 * turn).abs() < 1e-9 && gyro.values[4].is_nan());
    std::fs::write(&path, "n a\n0 0\n1 1\n2 9\n3 11\n").unwrap();
    let error = read(&path, "gyro_z=a", "gyro=deg").unwrap_err();
    assert!(error.contains("time between its rows"), "{error}");
}

/// A folder of each test's own, below `target`.
fn folder_of(test: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(test);
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

#[test]
fn what_our_own_export_writes_is_read_back_scaled_and_raw() {
    let mut model = model::ModelFile::paper();
    model.excitation.extend([
        ("vibration_g".to_owned(), 0.1),
        ("heater_degc".to_owned(), 3.0),
    ]);
    let record = model::simulate(&model, 20.0, 20.0, 4).unwrap();
    let folder = folder_of("what_our_own_export_writes_is_read_back_scaled_and_raw");
    for raw in [false, true] {
        let table = imu_stand::export::data::Table::of(&record, raw);
        let (npz, parquet) = (folder.join("own.npz"), folder.join("own.parquet"));
        table.write_npz(&npz).unwrap();
        table.write_parquet(&parquet).unwrap();
        for path in [npz, parquet] {
            let back = read(&path, "", "").unwrap();
            assert_eq!(back.seq, record.seq, "{path:?}");
            for channel in &record.channels {
                let got = back.channel(&channel.name).unwrap();
                assert_eq!(got.unit, channel.unit, "{path:?} {}", channel.name);
                for (a, b) in got.values.iter().zip(&channel.values) {
                    assert!((a - b).abs() < 1e-9, "{path:?} {}: {a} {b}", channel.name);
                }
                if raw {
                    assert_eq!(got.counts, channel.counts, "{path:?} {}", channel.name);
                }
            }
        }
    }
}
