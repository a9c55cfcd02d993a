//! Columns of times: their units, counters that begin again, dates.

use super::*;

#[test]
fn time_is_read_in_its_unit_and_as_a_date_and_asked_for_where_seconds_make_no_sense() {
    let map = "time=t,gyro_x=gx,gyro_y=gy";
    for (unit, per_s) in [("s", 1.0), ("ms", 1e3), ("us", 1e6), ("ns", 1e9)] {
        let text = table("t,gx,gy\n", ",", ".", per_s, 1.0);
        let units = format!("gyro=deg/s,time={unit}");
        is_the_table(&read(text.as_bytes(), map, &units).expect(unit));
        let head = format!("t_{unit},gx,gy\n");
        let text = table(&head, ",", ".", per_s, 1.0);
        let map = map.replace("time=t", &format!("time=t_{unit}"));
        is_the_table(&read(text.as_bytes(), &map, "gyro=deg/s").expect(&head));
    }
    let text = table("t,gx,gy\n", ",", ".", 1e3, 1.0);
    let said = error(text.as_bytes(), map, "gyro=deg/s");
    assert!(
        said.contains("20 s apart") && said.contains("time=ms"),
        "{said}"
    );
    assert!(read(text.as_bytes(), map, "gyro=deg/s,time=s").is_ok());
    let date = |k: usize| format!("2014-06-24 19:02:59.{:03}", 20 * k + 783);
    let rows = (0..8).map(|k| format!("{},{},-1\n", date(k), 0.25 * k as f64));
    let text: String = std::iter::once("t,gx,gy\n".to_owned())
        .chain(rows)
        .collect();
    is_the_table(&read(text.as_bytes(), map, "gyro=deg/s").expect("dates"));
    let said = error(
        b"t,gx,gy\n0,1,0\n2,1,0\n1,1,0\n9,1,0\n2,2,0\n",
        map,
        "gyro=deg/s",
    );
    assert!(said.contains("first in row 3"), "{said}");
}

#[test]
fn a_boards_microseconds_go_on_when_their_32_bits_begin_again() {
    let mut text = "micros,gx,gy\n".to_owned();
    for k in 0..8_u64 {
        let micros = (4_294_960_000 + 20_000 * k) % (1 << 32);
        text += &format!("{micros},{},-1\n", 0.25 * k as f64);
    }
    let read = read(
        text.as_bytes(),
        "time=micros,gyro_x=gx,gyro_y=gy",
        "gyro=deg/s",
    )
    .expect("times");
    is_the_table(&read);
    let notes = read.record.notes.join("; ");
    assert!(notes.contains("begins again (1 x)"), "{notes}");
    let said = error(text.as_bytes(), "", "");
    assert!(
        said.contains("time=micros") && said.contains("time=us"),
        "{said}"
    );
    let said = error(
        b"t,gx\n13/13/2026 19:02:59,1\n",
        "time=t,gyro_x=gx",
        "gyro=deg/s",
    );
    assert!(
        said.contains("`13/13/2026 19:02:59` is no time") && said.contains("a date like"),
        "{said}"
    );
}

#[test]
fn a_column_of_dates_is_a_time_whatever_it_is_called() {
    for name in ["date", "datetime", "UTC"] {
        let rows = (0..8).map(|k| format!("2026-03-01T12:00:00.{:03}Z,{k}\n", 20 * k));
        let text: String = std::iter::once(format!("{name},gx_dps\n"))
            .chain(rows)
            .collect();
        let read = read(text.as_bytes(), "", "").expect(name);
        let times = read.record.host_time_s.expect("a time");
        assert!(
            (times[7] - times[0] - 0.14).abs() < 1e-9,
            "{name}: {times:?}"
        );
    }
    let day = "date,time,gx_dps\n2026-03-01,12:00:00.00,1\n2026-03-01,12:00:00.02,2\n";
    let read = read(day.as_bytes(), "", "").expect("a day and a time of day");
    assert!(read.record.host_time_s.is_some());
}

#[test]
fn american_times_and_utf_16_are_read_as_spreadsheets_save_them() {
    let rows = (0..8).map(|k| {
        let of_day = match k {
            0..5 => format!("11:59:59.{:02} PM", 90 + 2 * k),
            _ => format!("12:00:00.{:02} AM", 2 * k - 10),
        };
        let date = if k < 5 { "11/28/2026" } else { "11/29/2026" };
        format!("{date} {of_day}\t{}\t-1\r\n", 0.25 * f64::from(k))
    });
    let text: String = std::iter::once("\u{feff}Time\tgx (°/s)\tgy (°/s)\r\n".to_owned())
        .chain(rows)
        .collect();
    is_the_table(&read(text.as_bytes(), "", "").expect("UTF-8"));
    for bytes in [u16::to_le_bytes, u16::to_be_bytes] {
        let utf_16: Vec<u8> = text.encode_utf16().flat_map(bytes).collect();
        is_the_table(&read(&utf_16, "", "").expect("UTF-16"));
    }
    // Which number is the month's, nothing says.
    let apart = text
        .replace("11/28/2026", "03/04/2026")
        .replace("11/29/2026", "05/06/2026");
    let said = error(apart.as_bytes(), "", "");
    assert!(
        said.contains("`05/06/2026 12:00:00.00 AM` is no time")
            && said.contains("write 2026-11-21"),
        "{said}"
    );
}
