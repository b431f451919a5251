//! `.vtp` and `.pvd` files, decoded here from the format's description alone, not by the writer's code.

use quick_xml::events::Event;
use std::collections::HashMap;
use std::io::Read;
use terramech_results::{Cells, Error, Field, PolyData, Precision, RunFolder, Values, VtkSeries};

type Attributes = HashMap<String, String>;

/// Elements of the XML head with their attributes, and the position of the first appended byte.
fn head(bytes: &[u8]) -> (Vec<(String, Attributes)>, usize) {
    let mark = b"<AppendedData encoding=\"raw\">";
    let at = bytes.windows(mark.len()).position(|w| w == mark).map_or(bytes.len(), |i| i + mark.len());
    let text = std::str::from_utf8(&bytes[..at]).unwrap();
    let mut reader = quick_xml::Reader::from_str(text);
    let mut elements = Vec::new();
    loop {
        match reader.read_event().unwrap() {
            Event::Start(e) | Event::Empty(e) => {
                let attributes = e.attributes().map(|a| a.unwrap());
                let map = attributes.map(|a| (a.key.as_ref().to_owned(), a.value.into_owned())).collect();
                elements.push((e.name().as_ref().to_owned(), map));
            }
            Event::Eof => break,
            _ => {}
        }
    }
    let start = bytes[at..].iter().position(|b| *b == b'_').map_or(at, |i| at + i + 1);
    (elements, start)
}

/// One appended array, inflated.
fn inflate(data: &[u8]) -> Vec<u8> {
    let word = |i: usize| u64::from_le_bytes(data[8 * i..8 * i + 8].try_into().unwrap()) as usize;
    let (count, size, last) = (word(0), word(1), word(2));
    let mut at = 8 * (3 + count);
    let mut out = Vec::new();
    for i in 0..count {
        let packed = word(3 + i);
        let before = out.len();
        flate2::read::ZlibDecoder::new(&data[at..at + packed]).read_to_end(&mut out).unwrap();
        let full = if i + 1 == count && last > 0 { last } else { size };
        assert_eq!(out.len() - before, full);
        at += packed;
    }
    out
}

fn arrays(bytes: &[u8]) -> HashMap<String, (String, Vec<f64>)> {
    let (elements, start) = head(bytes);
    let data = elements.iter().filter(|(name, _)| name == "DataArray");
    data.map(|(_, a)| {
        let raw = inflate(&bytes[start + a["offset"].parse::<usize>().unwrap()..]);
        let values = match a["type"].as_str() {
            "Float32" => raw.chunks(4).map(|c| f64::from(f32::from_le_bytes(c.try_into().unwrap()))).collect(),
            "Float64" => raw.chunks(8).map(|c| f64::from_le_bytes(c.try_into().unwrap())).collect(),
            "Int32" => raw.chunks(4).map(|c| f64::from(i32::from_le_bytes(c.try_into().unwrap()))).collect(),
            other => panic!("{other}"),
        };
        (a["Name"].clone(), (a["type"].clone(), values))
    })
    .collect()
}

#[test]
fn grains_come_back() {
    // Beyond one block of 256 KiB, and not a multiple of it.
    let n = 50_001;
    let points: Vec<f64> = (0..3 * n).map(|i| (i as f64 * 0.37).sin()).collect();
    let radius: Vec<f64> = (0..n).map(|i| 0.003 + 1e-8 * i as f64).collect();
    let id: Vec<i32> = (0..n).rev().collect();
    let fields = vec![Field::scalar("radius", &radius), Field::integer("id", &id), Field::vector("velocity", &points)];
    for (precision, kind, tolerance) in [(Precision::Single, "Float32", 6e-8), (Precision::Double, "Float64", 0.0)] {
        let bytes = PolyData::points(&points, fields.clone()).encode("bed", precision).unwrap();
        let back = arrays(&bytes);
        for (name, want) in [("Points", &points), ("velocity", &points), ("radius", &radius)] {
            let (stored, got) = &back[name];
            assert_eq!((stored.as_str(), got.len()), (kind, want.len()));
            assert!(got.iter().zip(want).all(|(a, b)| (a - b).abs() <= tolerance * b.abs().max(1e-30) + tolerance));
        }
        assert!(back["id"].1.iter().zip(&id).all(|(a, b)| *a == f64::from(*b)));
        assert!(back["connectivity"].1.iter().enumerate().all(|(i, v)| *v == i as f64));
        assert!(back["offsets"].1.iter().enumerate().all(|(i, v)| *v == (i + 1) as f64));
        let (elements, _) = head(&bytes);
        let piece = &elements.iter().find(|(name, _)| name == "Piece").unwrap().1;
        assert_eq!((piece["NumberOfPoints"].as_str(), piece["NumberOfVerts"].as_str()), ("50001", "50001"));
    }
}

#[test]
fn a_mesh_with_fields_on_points_and_cells_comes_back() {
    let points = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
    let triangles = [0, 1, 2, 0, 3, 1];
    let force: Vec<f64> = (0..12).map(f64::from).collect();
    let mut data = PolyData::triangles(&points, &triangles, vec![Field::vector("force <N> & more", &force)]);
    data.cell_data = vec![Field { name: "patch", components: 1, values: Values::Integer(&[7, 8]) }];
    let back = arrays(&data.encode("wheel", Precision::Single).unwrap());
    assert_eq!(back["Points"].1, points);
    assert_eq!(back["connectivity"].1, [0.0, 1.0, 2.0, 0.0, 3.0, 1.0]);
    assert_eq!(back["offsets"].1, [3.0, 6.0]);
    assert_eq!(back["patch"].1, [7.0, 8.0]);
    assert_eq!(back["force &lt;N&gt; &amp; more"].1, force, "names are escaped");
}

#[test]
fn an_empty_set_is_a_valid_file() {
    let bytes = PolyData::points(&[], vec![Field::scalar("radius", &[])]).encode("bed", Precision::Single).unwrap();
    assert!(arrays(&bytes)["radius"].1.is_empty());
}

#[test]
fn arrays_that_do_not_fit_are_named() {
    let points = [0.0; 9];
    let wrong = PolyData::points(&points, vec![Field::scalar("radius", &[1.0])]).encode("bed", Precision::Single);
    assert_eq!(wrong.unwrap_err().to_string(), "bed: field radius: 1 values given, 3 expected");
    let ragged = PolyData::points(&points[..8], vec![]).encode("bed", Precision::Single);
    assert!(matches!(ragged.unwrap_err(), Error::Length { given: 8, expected: 6, .. }));
    for bad in [3, -1] {
        let mesh = PolyData { cells: Cells::Triangles(&[0, 1, bad]), ..PolyData::points(&points, vec![]) };
        let error = mesh.encode("wheel", Precision::Single).unwrap_err();
        assert!(matches!(error, Error::Vertex { triangle: 0, count: 3, .. }), "{error}");
    }
}

#[test]
fn the_series_lists_whole_frames_after_each_write() {
    let dir = tempfile::tempdir().unwrap();
    let folder = RunFolder::create(dir.path()).unwrap();
    let mut series = VtkSeries::new("terrain.grain");
    for (i, time) in [0.0, 0.125, 0.3].into_iter().enumerate() {
        series.write(&folder, time, &PolyData::points(&[0.0, 0.0, time], vec![])).unwrap();
        let bytes = std::fs::read(folder.file("vtk/terrain_grain.pvd")).unwrap();
        let (elements, _) = head(&bytes);
        let sets: Vec<_> = elements.iter().filter(|(name, _)| name == "DataSet").map(|(_, a)| a).collect();
        assert_eq!(sets.len(), i + 1);
        assert_eq!(sets[i]["timestep"].parse::<f64>().unwrap(), time);
        assert!(folder.file(&format!("vtk/{}", sets[i]["file"])).exists());
    }
}

#[test]
fn a_series_of_pieces_that_others_write_is_listed() {
    let dir = tempfile::tempdir().unwrap();
    let folder = RunFolder::create(dir.path()).unwrap();
    let listed = |name: &str| std::fs::read_to_string(dir.path().join(name)).unwrap();
    let mut series = VtkSeries::new("bed").in_pieces(2);
    let points = [[0.0, 0.0, 0.1], [0.0, 0.0, 0.2]];
    let radius = [0.5];
    let pieces = points
        .each_ref()
        .map(|p| PolyData::points(p, vec![Field::scalar("radius", &radius), Field::vector("velocity", p)]));
    std::fs::create_dir_all(dir.path().join("vtk")).unwrap();
    for (k, piece) in pieces.iter().enumerate() {
        let path = dir.path().join(format!("{}_000000_{k}.vtp", series.path()));
        std::fs::write(path, piece.encode("bed", Precision::Single).unwrap()).unwrap();
    }
    let names = [0, 1].map(|k| format!("bed_000000_{k}.vtp"));
    let list = pieces[0].list("bed", Precision::Single, &names).unwrap();
    std::fs::write(dir.path().join("vtk/bed_000000.pvtp"), &list).unwrap();
    series.adopt(&folder, 0.0).unwrap();
    let (elements, _) = head(&list);
    let of = |tag: &str| elements.iter().filter(|(name, _)| name == tag).map(|(_, a)| a.clone()).collect::<Vec<_>>();
    assert_eq!(of("Piece").iter().map(|a| a["Source"].clone()).collect::<Vec<_>>(), names);
    let told: Vec<_> = of("PDataArray").iter().map(|a| (a["Name"].clone(), a["NumberOfComponents"].clone())).collect();
    let each = [("radius", "1"), ("velocity", "3"), ("Points", "3")].map(|(a, b)| (a.to_owned(), b.to_owned()));
    assert_eq!(told, each);
    assert!(listed("vtk/bed.pvd").contains("bed_000000.pvtp"));
    // An earlier part of a run in pieces, a later one whole; and the files of both belong to the run.
    let mut whole = VtkSeries::new("bed").after(&folder, &[0.0]);
    whole.write(&folder, 0.5, &pieces[0]).unwrap();
    let text = listed("vtk/bed.pvd");
    assert!(text.contains("bed_000000.pvtp") && text.contains("bed_000001.vtp"), "{text}");
    folder.begin().unwrap();
    drop(folder);
    RunFolder::open(dir.path()).unwrap().begin().unwrap();
    let left: Vec<_> = std::fs::read_dir(dir.path().join("vtk")).into_iter().flatten().collect();
    assert!(left.is_empty(), "{left:?}");
}
