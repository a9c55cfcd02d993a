//! What loggers do to a table: a FIFO that is read now and then, a counter of milliseconds that is short, a thermometer without
//! a reading, columns of which one is named. And simulated channels that do not step alike.

use imu_stand::capture::{Read, read_from, write_to};
use imu_stand::export::data::{Cells, Table};
use imu_stand::{ColumnMapping, ReadOptions};
use model::ModelFile;
use model::record::Record;

fn read(text: &str, columns: Option<&str>) -> Read {
    let options = ReadOptions {
        mapping: ColumnMapping::parse(columns, None).expect("a mapping"),
        ..ReadOptions::default()
    };
    read_from(text.as_bytes(), &options).expect("a table")
}

/// Rows of times and a gyro that says which row it is.
fn table(rows: usize, time: &dyn Fn(usize) -> String) -> String {
    let row = |k: usize| format!("{},{}\n", time(k), k % 1000);
    let rows: String = (0..rows).map(row).collect();
    format!("time_s,gyro_x_dps\n{rows}")
}

fn rate(read: &Read) -> f64 {
    read.record.header.rate_hz.expect("a rate")
}

#[test]
fn a_fifo_of_any_size_tells_the_rate_by_its_batches() {
    for size in [4, 8, 10, 16, 32] {
        // At 100 Hz; the rows of one reading 0.4 ms apart.
        let time = |k: usize| {
            let late = 2e-3 * ((k / size * 7919 % 101) as f64 / 101.0);
            let at = 0.01 * (k / size * size) as f64 + late + 4e-4 * (k % size) as f64;
            format!("{at:.6}")
        };
        let fifo = read(&table(20_000, &time), None);
        assert!(
            (rate(&fifo) / 100.0 - 1.0).abs() < 1e-3,
            "{size}: {} Hz",
            rate(&fifo)
        );
        let sampling = model::record::sampling::Sampling::of(&fifo.record, None).expect("a rate");
        assert_eq!(sampling.lost, 0, "{size}");
        let told = fifo
            .record
            .notes
            .iter()
            .filter(|n| n.contains("they tell arrival"));
        assert_eq!(told.count(), 1, "{:?}", fifo.record.notes);
    }
}

#[test]
fn a_counter_of_16_bits_goes_on_and_is_told_once() {
    let time = |k: usize| ((41_256 + 20 * k) % 65_536).to_string();
    let text = table(25_000, &time).replace("time_s", "time_ms");
    let wrapped = read(&text, None);
    let times = wrapped.record.host_time_s.as_ref().expect("times");
    assert!((times[24_999] - times[0] - 499.98).abs() < 1e-6);
    assert!((rate(&wrapped) - 50.0).abs() < 1e-6);
    let rows = wrapped.record.channels[0].values.iter().enumerate();
    assert!(rows.into_iter().all(|(k, v)| *v == (k % 1000) as f64));
    let notes = wrapped.record.notes.join("\n");
    let told = "the time begins again (8 x), as a counter of 16 bits does: taken to go on";
    assert_eq!(notes.matches("counter").count(), 1, "{notes}");
    assert!(
        notes.contains(told) && !notes.contains("set back"),
        "{notes}"
    );
    // The rate may be said beside it.
    let options = ReadOptions {
        rate_hz: Some(50.0),
        ..ReadOptions::default()
    };
    assert!(read_from(text.as_bytes(), &options).is_ok());
}

#[test]
fn a_clock_that_was_set_back_often_is_told_once() {
    // By 40 s, every minute.
    let time = |k: usize| format!("{:.2}", 0.05 * (k % 1200) as f64 + 20.0 * (k / 1200) as f64);
    let notes = read(&table(7200, &time), None).record.notes.join("\n");
    assert_eq!(notes.matches("was set back").count(), 1, "{notes}");
    assert!(
        notes.contains("at 5 places, first by 39.950 s before row 1201"),
        "{notes}"
    );
}

#[test]
fn a_thermometer_without_a_reading_has_none_and_a_column_is_named_beside_the_known_ones() {
    let row = |k: usize| {
        let temp = if k % 300 == 147 {
            85.0
        } else {
            20.0 + (k / 40) as f64 * 0.0625
        };
        format!(
            "{:.2},{},{temp:.4},{}\n",
            0.05 * k as f64,
            k % 7,
            5.0 - 1e-4 * k as f64
        )
    };
    let rows: String = (0..3000).map(row).collect();
    let text = format!("time_s,gyro_x_dps,temp_degC,supply_V\n{rows}");
    let alone = read(&text, None);
    let temp = alone.record.channel("temp").expect("a thermometer");
    assert_eq!(temp.values.iter().filter(|v| v.is_nan()).count(), 10);
    assert!(
        alone
            .record
            .notes
            .iter()
            .any(|n| n.contains("10 x 85 degC")),
        "{:?}",
        alone.record.notes
    );
    assert!(alone.record.channel("supply").is_none());
    for columns in ["supply=supply_V", "supply=4", "time=time_s,supply=supply_V"] {
        let named = read(&text, Some(columns)).record;
        assert_eq!(named.host_time_s, alone.record.host_time_s, "{columns}");
        for name in ["gyro_x", "temp", "supply"] {
            assert!(named.channel(name).is_some(), "{columns}: {name}");
        }
    }
}

/// A model whose gyros have these steps, and accelerometers others.
fn stepping(steps: [Option<f64>; 3]) -> ModelFile {
    let mut model = ModelFile::paper();
    let z = (model.channels.iter().find(|c| c.name == "gyro_z"))
        .expect("a gyro")
        .clone();
    model.channels = ["gyro_x", "gyro_y", "gyro_z"]
        .into_iter()
        .zip(steps)
        .map(|(name, lsb)| model::file::ChannelModel {
            name: name.to_owned(),
            lsb,
            ..z.clone()
        })
        .collect();
    for (name, lsb) in [
        ("acc_x", Some(0.0098)),
        ("acc_y", None),
        ("acc_z", Some(0.01)),
    ] {
        let mut c = z.clone();
        (c.name, c.unit, c.lsb) = (name.to_owned(), "m/s^2".to_owned(), lsb);
        model.channels.push(c);
    }
    model.effects.clear();
    model
}

#[track_caller]
fn is_the_same(read: &Record, simulated: &Record, to: f64) {
    for own in &simulated.channels {
        let c = read.channel(&own.name).expect("all are written");
        for (a, b) in c.values.iter().zip(&own.values) {
            assert!((a - b).abs() <= to, "{}: {a}, and it was {b}", own.name);
        }
    }
}

#[test]
fn simulated_channels_that_step_differently_are_read_as_they_were_simulated() {
    let small = 1.0 / 131.0;
    for steps in [
        [Some(0.0076), Some(0.0076), None],
        [Some(1.0), Some(0.01), Some(0.001)],
        [Some(small), Some(0.061), None],
        [Some(0.061), Some(small), Some(1.0 / 16.4)],
    ] {
        let simulated = model::simulate(&stepping(steps), 60.0, 20.0, 3).expect("a run");
        let mut text = Vec::new();
        write_to(&mut text, &simulated).expect("memory");
        let read = read_from(&*text, &ReadOptions::default())
            .expect("a capture")
            .record;
        is_the_same(&read, &simulated, 1e-6);
        for (name, step) in ["gyro_x", "gyro_y", "gyro_z"].iter().zip(steps) {
            let c = read.channel(name).expect("a gyro");
            if let Some(step) = step {
                assert!((c.lsb.expect("a step") / step - 1.0).abs() < 1e-9, "{name}");
                assert_eq!(
                    c.counts,
                    simulated.channel(name).expect("a gyro").counts,
                    "{name}"
                );
            }
        }
        // Who knows the scale of the header alone has the same rates.
        let text = String::from_utf8(text).expect("text");
        let plain: Vec<&str> = text.lines().filter(|l| !l.contains("_step_")).collect();
        let read = read_from(plain.join("\n").as_bytes(), &ReadOptions::default());
        is_the_same(&read.expect("a capture").record, &simulated, 1e-6);
        // And in the counts of an export.
        for record in [
            &simulated,
            &read_from(text.as_bytes(), &ReadOptions::default())
                .expect("it")
                .record,
        ] {
            let table = Table::of(record, true);
            let of = |key: &str| {
                table
                    .about
                    .iter()
                    .find(|(k, _)| k == key)
                    .map(|(_, v)| v.clone())
            };
            let lsb: f64 = of("gyro_lsb_dps")
                .expect("a scale")
                .parse()
                .expect("a number");
            for name in ["gyro_x", "gyro_y", "gyro_z"] {
                let column = table
                    .columns
                    .iter()
                    .find(|c| c.name == name)
                    .expect("a gyro");
                let Cells::Whole(counts) = &column.cells else {
                    panic!("{name} is in counts");
                };
                let own = &simulated.channel(name).expect("a gyro").values;
                let far = |(c, v): (&i64, &f64)| (*c as f64 * lsb - v).abs() > 1e-6;
                assert!(!counts.iter().zip(own).any(far), "{name}");
            }
        }
    }
}

#[test]
fn estimates_of_one_step_are_one() {
    let small = 1.0 / 131.0;
    let steps = [Some(small), Some(small * (1.0 + 3e-7)), Some(small)];
    let mut model = stepping(steps);
    model.channels.truncate(3);
    let simulated = model::simulate(&model, 60.0, 20.0, 3).expect("a run");
    let mut text = Vec::new();
    write_to(&mut text, &simulated).expect("memory");
    let text = String::from_utf8(text).expect("text");
    let scale = format!("# gyro_lsb_dps: {small}\n");
    assert!(text.contains(&scale) && !text.contains("_step_"));
}
