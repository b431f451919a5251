//! `results.csv`: header, exact values, quoting, and what a stopped run leaves.

use std::path::Path;
use terramech_results::{Column, CsvTable, CsvWriter, Data, Error, Kind, RunFolder, Value};

fn column(name: &str, unit: &str, kind: Kind) -> Column {
    Column { name: name.into(), unit: unit.into(), kind }
}

fn text_of(columns: &[Column], rows: &[(f64, Vec<Value>)]) -> String {
    let mut out = Vec::new();
    let mut csv = CsvWriter::new(&mut out, "mem.csv", columns).unwrap();
    for (time, values) in rows {
        csv.row(*time, values.iter().copied()).unwrap();
    }
    drop(csv);
    String::from_utf8(out).unwrap()
}

#[test]
fn header_and_rows_are_as_documented() {
    let columns = [
        Column::real("rig.drawbar_pull", "N"),
        Column::real("rig.slip", ""),
        column("terrain.contacts", "", Kind::Integer),
        column("rig.down", "", Kind::Boolean),
        column("rig.note", "", Kind::Text),
    ];
    let row =
        vec![Value::Real(-0.97), Value::Real(0.5), Value::Integer(-3), Value::Boolean(true), Value::Text("a, \"b\"")];
    assert_eq!(
        text_of(&columns, &[(0.001, row)]),
        "time [s],rig.drawbar_pull [N],rig.slip [1],terrain.contacts [1],rig.down [1],rig.note [-]\n\
         0.001,-0.97,0.5,-3,1,\"a, \"\"b\"\"\"\n"
    );
}

#[test]
fn reals_come_back_to_the_bit() {
    let mut values = vec![
        0.0,
        -0.0,
        1.0,
        0.1,
        1.0 / 3.0,
        f64::MAX,
        -f64::MIN_POSITIVE,
        5e-324,
        1e21,
        123456789012345680.0,
        f64::INFINITY,
        f64::NEG_INFINITY,
    ];
    // Bit patterns of all magnitudes, from a linear congruential generator (Knuth, MMIX).
    let mut seed = 1_u64;
    for _ in 0..5000 {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        values.push(f64::from_bits(seed));
    }
    values.retain(|x| !x.is_nan());
    let rows: Vec<_> = values.iter().map(|x| (*x, vec![Value::Real(*x)])).collect();
    let table = CsvTable::parse(&text_of(&[Column::real("u.x", "m")], &rows), Path::new("mem.csv")).unwrap();
    let bits = |v: &[f64]| v.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
    assert_eq!(bits(table.numbers("u.x").unwrap()), bits(&values));
    assert_eq!(bits(&table.time), bits(&values));
    let nan = CsvTable::parse("time [s],a.b [m]\n0,NaN\n", Path::new("m")).unwrap();
    assert!(nan.numbers("a.b").unwrap()[0].is_nan());
}

#[test]
fn names_units_and_text_come_back() {
    let columns =
        [column("a.\"odd\", name", "kg.m2/s", Kind::Real), column("b.text", "", Kind::Text), Column::real("c.n", "")];
    let texts = ["plain", "two\nlines", " edges ", "", "\"", "1e3"];
    let rows: Vec<_> = texts.iter().map(|t| (0.0, vec![Value::Real(1.0), Value::Text(t), Value::Real(2.0)])).collect();
    let table = CsvTable::parse(&text_of(&columns, &rows), Path::new("mem.csv")).unwrap();
    assert_eq!(table.columns[0].name, "a.\"odd\", name");
    assert_eq!(table.columns[0].unit, "kg.m2/s");
    assert_eq!(table.columns[1].data, Data::Text(texts.map(String::from).to_vec()));
    assert_eq!(table.columns[2].unit, "");
}

#[test]
fn rows_that_do_not_fit_are_refused_and_leave_no_trace() {
    let mut out = Vec::new();
    let mut csv = CsvWriter::new(&mut out, "mem.csv", &[Column::real("u.x", "m")]).unwrap();
    for bad in [vec![], vec![Value::Integer(1)], vec![Value::Real(1.0), Value::Real(2.0)]] {
        assert!(matches!(csv.row(2.0, bad).unwrap_err(), Error::Row { time: 2.0, .. }));
    }
    csv.row(3.0, [Value::Real(1.5)]).unwrap();
    drop(csv);
    assert_eq!(String::from_utf8(out).unwrap(), "time [s],u.x [m]\n3,1.5\n");
}

#[test]
fn flushed_rows_are_on_disk_and_a_cut_row_is_left_out() {
    let dir = tempfile::tempdir().unwrap();
    let folder = RunFolder::create(dir.path()).unwrap();
    let mut csv = CsvWriter::create(&folder, &[Column::real("u.x", "m")]).unwrap();
    let path = folder.file("results.csv");
    csv.row(0.0, [Value::Real(1.0)]).unwrap();
    csv.flush().unwrap();
    assert_eq!(CsvTable::read(&path).unwrap().time, [0.0]);
    std::fs::write(&path, "time [s],u.x [m]\n0,1\n0.1,2.").unwrap();
    assert_eq!(CsvTable::read(&path).unwrap().time, [0.0]);
}

#[test]
fn wrong_files_are_told_by_line() {
    let says = |text: &str| CsvTable::parse(text, Path::new("r.csv")).unwrap_err().to_string();
    assert!(says("t,x\n").contains("r.csv: line 1"));
    assert!(says("").contains("no header"));
    assert!(says("x [m]\n").contains("time [s]"));
    assert!(says("time [s],a.b [m]\n0,1\n1,x\n").contains("line 3: \"x\" is not a number"));
    assert!(says("time [s],a.b [m]\n0,1,2\n").contains("line 2: 3 fields"));
}
