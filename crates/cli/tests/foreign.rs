//! Tables of others as text: what separates their cells, where their names and units stand, and what is said where that
//! cannot be told. All but the errors hold the same rows, 20 ms apart: gyro x rises by 0.25 deg/s a row, y is -1 deg/s.

#[path = "foreign/any_bytes.rs"]
mod any_bytes;
#[path = "foreign/forms.rs"]
mod forms;
#[path = "foreign/interleaved.rs"]
mod interleaved;
#[path = "foreign/names.rs"]
mod names;
#[path = "foreign/pandas.rs"]
mod pandas;
#[path = "foreign/times.rs"]
mod times;

use imu_stand::capture::{Read, read_from};
use imu_stand::{CaptureError, ColumnMapping, ReadOptions};

fn options(columns: &str, units: &str) -> Result<ReadOptions, CaptureError> {
    let some = |text: &'static str| (!text.is_empty()).then_some(text);
    let (columns, units) = (columns.to_owned().leak(), units.to_owned().leak());
    Ok(ReadOptions {
        mapping: ColumnMapping::parse(some(columns), some(units))?,
        ..ReadOptions::default()
    })
}

fn read(text: &[u8], columns: &str, units: &str) -> Result<Read, CaptureError> {
    read_from(text, &options(columns, units)?)
}

/// The error as the user sees it: what is wrong, and what to do.
fn error(text: &[u8], columns: &str, units: &str) -> String {
    let error = read(text, columns, units).expect_err("it is wrong");
    let help = miette::Diagnostic::help(&error).map(|help| help.to_string());
    format!("{error}\n{}", help.unwrap_or_default())
}

/// A table: lines before the rows, what separates cells, the sign before fractions, units a second and a deg/s.
fn table(head: &str, separator: &str, sign: &str, per_s: f64, per_dps: f64) -> String {
    let mut text = head.to_owned();
    for k in 0..8 {
        let cells = [
            0.02 * f64::from(k) * per_s,
            0.25 * f64::from(k) * per_dps,
            -per_dps,
        ];
        let cells = cells.map(|cell| format!("{cell}").replace('.', sign));
        text += &cells.join(separator);
        text += "\r\n";
    }
    text
}

const RAD: f64 = std::f64::consts::PI / 180.0;

#[track_caller]
fn is_the_table(read: &Read) {
    let times = read.record.host_time_s.as_ref().expect("a time column");
    let x = &read.record.channel("gyro_x").expect("gyro x");
    let y = &read.record.channel("gyro_y").expect("gyro y");
    assert_eq!((times.len(), x.unit.as_str()), (8, "deg/s"));
    for k in 0..8 {
        let at = k as f64;
        assert!((times[k] - times[0] - 0.02 * at).abs() < 1e-6, "{times:?}");
        assert!((x.values[k] - 0.25 * at).abs() < 1e-9, "{:?}", x.values);
        assert!((y.values[k] + 1.0).abs() < 1e-9, "{:?}", y.values);
    }
}

#[test]
fn cells_between_commas_semicolons_tabs_and_blanks_and_decimal_commas_are_read() {
    let (map, units) = ("time=t,gyro_x=gx,gyro_y=gy", "gyro=deg/s");
    for (head, separator, sign) in [
        ("t,gx,gy\n", ",", "."),
        ("t, gx, gy\n", ", ", "."),
        ("t;gx;gy\n", ";", "."),
        ("t;gx;gy\n", ";", ","),
        ("sep=;\nt;gx;gy\n", ";", ","),
        ("t\tgx\tgy\n", "\t", "."),
        ("t\tgx\tgy\n", "\t", ","),
        ("t gx gy\n", "  ", "."),
        ("t gx gy\n", "  ", ","),
        ("t, gx, gy\n", "  ", "."),
        ("\u{feff}\"t\";\"gx\";\"gy\"\n", ";", "."),
    ] {
        let text = table(head, separator, sign, 1.0, 1.0);
        is_the_table(&read(text.as_bytes(), map, units).expect(head));
        let old = text.replace("\r\n", "\n").replace('\n', "\r");
        is_the_table(&read(old.as_bytes(), map, units).expect(head));
    }
    // The last cell of a row may be empty.
    let last = read(b"t\tgx\tgy\n0\t1\t\n1\t2\t3\n", map, units).expect("tabs");
    assert!(last.record.channel("gyro_y").expect("y").values[0].is_nan());
    // One file has one sign.
    let said = error(b"t;gx;gy\n0,5;1,5;2\n1.5;1.5;2\n", map, units);
    assert!(said.contains("line 3, column `time`: `1.5`"), "{said}");
}

#[test]
fn a_header_in_a_comment_is_one_and_a_table_without_names_goes_by_numbers() {
    let euroc = "#timestamp [ns],w_x [rad s^-1],w_y [rad s^-1]\n";
    let text = table(euroc, ",", ".", 1e9, RAD);
    let by_name = "time=timestamp,gyro_x=w_x,gyro_y=w_y [rad s^-1]";
    is_the_table(&read(text.as_bytes(), by_name, "").expect("the header's units"));
    let none = table("# rate_hz: 50\n", ",", ".", 1.0, 1.0);
    is_the_table(
        &read(none.as_bytes(), "time=1,gyro_x=2,gyro_y=3", "gyro=deg/s").expect("numbers"),
    );
    let said = error(none.as_bytes(), "", "");
    assert!(
        said.contains("--columns time=1,gyro_x=2,gyro_y=3 --units gyro=UNIT"),
        "{said}"
    );
    let said = error(none.as_bytes(), "gyro_x=4", "");
    assert!(said.contains("there is no column `4`"), "{said}");
}

#[test]
fn our_own_names_with_a_unit_from_anywhere_need_no_mapping() {
    for (head, per_s, per_dps, units) in [
        ("time, gyro_x, gyro_y\n", 1.0, 1.0, "gyro=deg/s"),
        ("time,gyro_x,gyro_y\n", 1e3, RAD, "time=ms,gyro=rad/s"),
        ("time (ms),gyro_x (rad/s),gyro_y (rad/s)\n", 1e3, RAD, ""),
        ("time,gyro_x,gyro_y\ns,deg/s,deg/s\n", 1.0, 1.0, ""),
        // A time of another name that says its unit.
        ("time_ms,gyro_x,gyro_y\n", 1e3, RAD, "gyro=rad/s"),
        ("timestamp_ns,gyro_x,gyro_y\n", 1e9, 1.0, "gyro=deg/s"),
        ("t_us,gyro_x (rad/s),gyro_y (rad/s)\n", 1e6, RAD, ""),
        ("time,gyro_x,gyro_y\n[us],[°/s],[°/s]\n", 1e6, 1.0, ""),
        (
            "# unit of gyro_x: deg/s\n# unit of gyro_y: deg/s\ntime,gyro_x,gyro_y\n",
            1.0,
            1.0,
            "",
        ),
    ] {
        let text = table(head, ",", ".", per_s, per_dps);
        is_the_table(&read(text.as_bytes(), "", units).expect(head));
    }
    // Without one the cells are counts, and a key is missing.
    let text = table("time,gyro_x,gyro_y\n", ",", ".", 1.0, 1.0);
    let said = error(text.as_bytes(), "", "");
    assert!(
        said.contains("gyro_lsb_dps") && said.contains("--units gyro=deg/s"),
        "{said}"
    );
    // A capture has its scales in its header, whatever is said.
    let own = "# format: imu-stand-capture/1\n# gyro_lsb_dps: 0.07\nseq,gyro_x\n0,1\n";
    for unit in ["gyro=furlong/s", "gyro=rad/s"] {
        let said = error(own.as_bytes(), "", unit);
        assert!(
            said.contains("--units") && said.contains("counts"),
            "{said}"
        );
    }
}

#[test]
fn a_gyros_unit_is_asked_for_what_is_assumed_is_told_and_what_contradicts_itself_is_refused() {
    let map = "time=t,gyro_x=gx,gyro_y=gy";
    let text = table("t,gx,gy\n", ",", ".", 1.0, 1.0);
    let said = error(text.as_bytes(), map, "");
    assert!(
        said.contains("nothing says the unit of gyro_x, gyro_y") && said.contains("gyro=rad/s"),
        "{said}"
    );
    let counts = table("t,gx,gy\n", ",", ".", 1e4, 131.0);
    let units = "time=0.1ms,gyro=0.00763358778625954deg/s";
    is_the_table(&read(counts.as_bytes(), map, units).expect("counts"));
    let warm = "time=t,gyro_x=gx,temp=gy";
    let notes = read(text.as_bytes(), warm, "gyro=deg/s")
        .expect("degC")
        .record
        .notes;
    assert_eq!(notes.len(), 1);
    assert!(notes[0].starts_with("temp taken in degC"), "{notes:?}");
    let head = table("t,gx (rad/s),gy (rad/s)\n", ",", ".", 1.0, 1.0);
    let notes = read(head.as_bytes(), map, "gyro=deg/s")
        .expect("deg/s")
        .record
        .notes;
    assert!(
        notes[0].contains("says rad/s") && notes.len() == 2,
        "{notes:?}"
    );
    for (columns, units, expected) in [
        (map, "gyro=deg/s,gyro=rad/s", "`gyro` is given twice"),
        ("gyro_x=gx,gyro_x=gy", "", "`gyro_x` is given twice"),
        (map, "gyros=deg/s", "`gyros` is neither"),
        (map, "gyro=furlong/s", "no unit of an angular rate"),
        (map, "time=deg/s", "no unit of time"),
        ("time=t,gyro_x=hx", "", "there is no column `hx`"),
    ] {
        let said = error(text.as_bytes(), columns, units);
        assert!(said.contains(expected), "{columns} {units}: {said}");
    }
    let own = b"# format: imu-stand-capture/1\n# gyro_lsb_dps: 1\ngyro_x,gyro_x\n1,2\n";
    let said = error(own, "", "");
    assert!(said.contains("two columns are called `gyro_x`"), "{said}");
    let twice = b"t,gx,gx\n0,1,2\n";
    let said = error(twice, "gyro_x=gx", "gyro=deg/s");
    assert!(said.contains("--columns gyro_x=2"), "{said}");
    assert!(read(twice, "gyro_x=3", "gyro=deg/s").is_ok());
}

#[test]
fn what_is_no_text_is_named() {
    for (bytes, expected) in [
        (&b"\xff\xfe\0\0t\0\0\0"[..], "UTF-32"),
        (b"PK\x03\x04", "spreadsheet"),
        (b"PAR1", "Parquet"),
        (b"\x89HDF\r\n", "HDF5"),
        (b"\xfd7zXZ\0", "unpack it first"),
        (b"\x7fELF\0\0\0", "binary"),
    ] {
        let said = error(bytes, "", "");
        assert!(said.contains(expected), "{said}");
    }
    // Latin-1, as old programs write degrees.
    let head = b"t,gx (\xb0/s),gy (\xb0/s)\n";
    let mut text = head.to_vec();
    text.extend(table("", ",", ".", 1.0, 1.0).bytes());
    let read = read(&text, "time=t,gyro_x=gx,gyro_y=gy", "").expect("Latin-1");
    is_the_table(&read);
    assert!(read.record.notes.is_empty(), "{:?}", read.record.notes);
}

#[test]
fn text_in_a_column_that_nobody_asked_for_is_left_alone_and_told() {
    let head = "# format: imu-stand-capture/1\n# rate_hz: 50\n# gyro_lsb_dps: 0.25\n";
    let rows = "seq,gyro_x,note,blank,spare\n0,0,start,,7\n1,1,\"warm, at last\",,8\n2,2,,,9\n";
    let ours = read(format!("{head}{rows}").as_bytes(), "", "").expect("a capture with notes");
    let names: Vec<&str> = (ours.record.channels.iter())
        .map(|c| c.name.as_str())
        .collect();
    assert_eq!((names, ours.record.len()), (vec!["gyro_x", "spare"], 3));
    let notes = ours.record.notes.join("; ");
    for told in [
        "`note` holds text (line 5: `start`)",
        "`blank` holds no number",
    ] {
        assert!(notes.contains(told), "{notes}");
    }
    let mapped = read(
        b"t,gx,note\n0,1,a\n0.02,2,b\n",
        "time=t,gyro_x=gx",
        "gyro=deg/s",
    );
    assert_eq!(mapped.expect("two columns").record.channels.len(), 1);
    // Who asks for it is told that it cannot be had.
    let said = error(
        b"t,gx,note\n0,1,a\n0.02,2,b\n",
        "gyro_x=gx,acc_x=note",
        "gyro=deg/s",
    );
    assert!(said.contains("line 2, column `acc_x`: `a`"), "{said}");
}

#[test]
fn temperatures_come_by_any_spelling_and_unit_and_names_are_not_taken_twice() {
    let text = b"time,gx,temp_f\n0,1,68\n0.02,2,86\n";
    let all = "t=time,GyroX=gx,temperature=temp_f";
    let read = |columns| {
        read(text, columns, "gyro=deg/s,temp=degF")
            .expect(columns)
            .record
    };
    let record = read(all);
    let temp = record.channel("temp").expect("by its name here");
    assert!((temp.values[0] - 20.0).abs() < 1e-9 && (temp.values[1] - 30.0).abs() < 1e-9);
    assert_eq!(temp.unit, "degC");
    assert!(record.host_time_s.is_some() && record.channel("gyro_x").is_some());
    let notes = record.notes.join("; ");
    assert!(
        notes.contains("`temperature` is taken as `temp`"),
        "{notes}"
    );
    let said = error(text, "gyro_x=gx,temp=temp_f,temperature=temp_f", "");
    assert!(
        said.contains("`temp_f` is given to temp and to temperature"),
        "{said}"
    );
}

#[test]
fn a_misspelt_column_is_told_with_the_name_that_was_meant_and_another_spelling_is_taken() {
    let head = "# format: imu-stand-capture/1\n# rate_hz: 50\n# gyro_lsb_dps: 0.25\n# temp_lsb_c: 0.1\n# temp_zero_c: 25\n";
    let rows = "seq,gyro_x,Gyro-Y,gyro_zz,temp_X,vibration_g\n0,0,4,8,10,1\n1,1,5,9,20,2\n";
    let ours = read(format!("{head}{rows}").as_bytes(), "", "").expect("a capture");
    let value = |name: &str| ours.record.channel(name).expect(name).values[0];
    assert_eq!(
        (value("gyro_y"), value("temp_x"), value("gyro_zz")),
        (1.0, 26.0, 8.0)
    );
    let notes = &ours.record.notes;
    for told in [
        "`Gyro-Y` is taken as `gyro_y`",
        "`temp_X` is taken as `temp_x`",
        "`gyro_zz` is none of the format's, so it is a channel of its own, which no cause knows: did you mean `gyro_z`?",
    ] {
        let times = notes.iter().filter(|note| note.contains(told)).count();
        assert_eq!(times, 1, "{told}: {notes:?}");
    }
    assert_eq!(notes.len(), 3, "{notes:?}");

    let text =
        "Time (ms),gyro_x (rad/s),Gyro Y (rad/s),gyro_zz (rad/s),spare\n0,1,2,3,4\n20,1,2,3,4\n";
    let theirs = read(text.as_bytes(), "", "").expect("measured values");
    assert_eq!(theirs.record.host_time_s.as_deref(), Some(&[0.0, 0.02][..]));
    assert_eq!(theirs.record.channels.len(), 2);
    let notes = theirs.record.notes.join("; ");
    assert!(
        notes.contains("not read, as their names are none of the stand's: `gyro_zz` (did you mean `gyro_z`?), `spare`;"),
        "{notes}"
    );
}

#[test]
fn a_file_of_another_kind_is_called_by_its_name_and_long_names_are_cut() {
    for (start, what) in [("{\"t\":[0,1]}", "JSON"), ("<!DOCTYPE html>", "a web page")] {
        let said = error(start.as_bytes(), "", "");
        assert!(
            said.contains(&format!("this is {what}")) && said.contains("as CSV"),
            "{said}"
        );
    }
    let names: Vec<String> = (0..500)
        .map(|k| format!("{k}{}", "n".repeat(1000)))
        .collect();
    let text = format!("{}\n{}\n", names.join(","), vec!["1"; 500].join(","));
    let said = error(text.as_bytes(), "", "");
    assert!(
        said.len() < 2000 && said.contains("and 480 more"),
        "{}",
        said.len()
    );
}

#[test]
fn lines_before_the_table_are_passed_over_and_told() {
    let before = "Device: XYZ 3000\nSerial;1234\n\nComment, by hand\n";
    for head in ["t,gx,gy\n", "t,gx,gy\ns,deg/s,deg/s\n"] {
        let text = format!("{before}{}", table(head, ",", ".", 1.0, 1.0));
        let read = read(text.as_bytes(), "time=t,gyro_x=gx,gyro_y=gy", "gyro=deg/s").expect(head);
        is_the_table(&read);
        let notes = read.record.notes.join("; ");
        assert!(
            notes.contains("begins in line 5") && notes.contains("from line 1 on"),
            "{notes}"
        );
    }
    // Nothing is passed over where no table follows.
    let said = error(b"remark\nanother one\n", "gyro_x=gx", "");
    assert!(
        said.contains("there is no column `gx`; the columns are: remark"),
        "{said}"
    );
}

#[test]
fn files_put_end_to_end_with_their_names_are_read_on_and_told() {
    let part = table("t_s,gx_dps,gy_dps\n", ",", ".", 1.0, 1.0);
    let later: String = (8..16)
        .map(|k| format!("{:.2},1,-1\n", 0.02 * f64::from(k)))
        .collect();
    let text = format!("{part}t_s,gx_dps,gy_dps\n{later}");
    let both = read(text.as_bytes(), "", "").expect("two parts");
    assert_eq!(both.record.len(), 16);
    let notes = both.record.notes.join("; ");
    assert!(
        notes.contains("stand again 1 x, first in line 10"),
        "{notes}"
    );
    // Other names are no names again.
    let other = format!("{part}{}", part.replace("gy_dps", "gz_dps"));
    let said = error(other.as_bytes(), "", "");
    assert!(said.contains("line 10"), "{said}");
}

#[test]
fn decimal_commas_between_commas_and_names_that_stand_twice_are_told() {
    let text = table("t_s,gx_dps,gy_dps\n", ",", ",", 1.0, 1.0);
    let said = error(text.as_bytes(), "", "");
    assert!(
        said.contains("the table has 3 columns") && said.contains("decimal commas"),
        "{said}"
    );
    let said = error(b"t_s,gx_dps,gx_dps\n0,1,2\n1,3,1\n", "", "");
    assert!(
        said.contains("two columns are called `gx_dps`") && said.contains("gyro_x=2"),
        "{said}"
    );
}
