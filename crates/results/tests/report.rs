//! The report: one file, whole, small, and true to the data it was given.

use std::path::Path;
use terramech_results::report::{Axis, Disc, Item, Plot, Section, SideView, Style, Table};
use terramech_results::{Column, CsvTable, CsvWriter, Error, Headline, Manifest, Report, Value};

/// Every drawing of the page, each of which must be well-formed XML.
fn drawings(html: &str) -> Vec<&str> {
    html.match_indices("<svg").map(|(at, _)| &html[at..at + html[at..].find("</svg>").unwrap() + 6]).collect()
}

fn count_discs(html: &str) -> usize {
    drawings(html).iter().map(|d| d.matches("<circle cx").count()).sum()
}

fn check_whole(html: &str) {
    for drawing in drawings(html) {
        let mut reader = quick_xml::Reader::from_str(drawing);
        while reader.read_event().unwrap() != quick_xml::events::Event::Eof {}
        assert!(!drawing.contains("NaN") && !drawing.contains("inf"), "{drawing}");
    }
    for outside in ["http:", "https:", "src=\"/", "@import", "<link"] {
        assert!(!html.contains(outside), "{outside}");
    }
    let ids: Vec<&str> = html.split("clipPath id=\"").skip(1).map(|s| s.split('"').next().unwrap()).collect();
    let distinct: std::collections::BTreeSet<_> = ids.iter().collect();
    assert_eq!(ids.len(), distinct.len());
}

fn wheel_run(rows: usize) -> CsvTable {
    let names = ["rig.drawbar_pull_filtered", "rig.drawbar_pull", "rig.sinkage", "tire.force.x", "tire.force.y"];
    let units = ["N", "N", "m", "N", "N"];
    let columns: Vec<Column> = names.iter().zip(units).map(|(n, u)| Column::real(*n, u)).collect();
    let mut out = Vec::new();
    let mut csv = CsvWriter::new(&mut out, "mem", &columns).unwrap();
    for i in 0..rows {
        let t = i as f64 * 1e-3;
        let noise = (i as f64 * 12.9898).sin();
        let raw = if i == rows / 2 { -500.0 } else { 1.0 + noise };
        csv.row(t, [1.0, raw, 0.02 * t, noise, 0.25].map(Value::Real)).unwrap();
    }
    drop(csv);
    CsvTable::parse(&String::from_utf8(out).unwrap(), Path::new("mem")).unwrap()
}

#[test]
fn a_run_becomes_one_small_whole_page() {
    let csv = wheel_run(50_000);
    let summary = [
        Headline::mean("rig.drawbar_pull", "N", &csv.time, csv.numbers("rig.drawbar_pull").unwrap(), [10.0, 20.0])
            .label("Drawbar pull <net>")
            .measured(0.97, "a bench"),
        Headline::new("rig.sinkage", 0.0214, "m"),
    ];
    let mut manifest = Manifest::start("0.1.0", vec!["terramech".into(), "run".into(), "a<b>.ssd".into()]);
    manifest.wall_seconds = 151.0;
    let view = SideView::new("bed").grains(&[0.0, 0.0, 0.1], &[0.003], &[0.0, 0.0, 1.0], 0.0).unwrap();
    let html = Report::of_run("Wheel & soil", &csv, &summary, &manifest, vec![view]).html();
    check_whole(&html);
    assert!(html.len() < 200_000, "{}", html.len());
    for text in [
        "Wheel &amp; soil",
        "Drawbar pull &lt;net&gt;",
        "a&lt;b&gt;.ssd",
        "drawbar pull [N]",
        "sinkage [m]",
        "averaged over 10 to 20 s",
        "21.40</td>",
        "mm</td>",
        "2 min 31 s",
        "Raw values reach from -500 to 2.00 N",
        "All of tire: 2 recorded scalars",
        "Constant over the run",
    ] {
        assert!(html.contains(text), "{text}");
    }
}

#[test]
fn raw_and_filtered_share_a_plot_and_a_colour() {
    let html = Report::of_run("t", &wheel_run(100), &[], &Manifest::start("0", vec![]), vec![]).html();
    let plot = drawings(&html).into_iter().find(|d| d.contains("aria-label=\"Drawbar pull\"")).unwrap();
    let raw = plot.find("class=\"raw c0\" data-label=\"raw\"").unwrap();
    let filtered = plot.find("class=\"line c0\" data-label=\"filtered\"").unwrap();
    assert!(raw < filtered, "the filtered line lies on top");
}

#[test]
fn lines_pass_through_their_points() {
    let plot = Plot::new("p", Axis::new("time", "s"), Axis::new("y", "N"));
    let plot = plot.with("a", &[0.0, 5.0, 10.0], &[0.0, 30.0, -10.0], Style::Line);
    let html = Report { sections: vec![Section::new("s", vec![Item::Plot(plot)])], ..Report::default() }.html();
    let attribute = |name: &str| {
        let rest = &html[html.find(&format!(" {name}=\"")).unwrap() + name.len() + 3..];
        rest[..rest.find('"').unwrap()].to_owned()
    };
    let numbers = |name: &str| attribute(name).split(' ').map(|n| n.parse::<f64>().unwrap()).collect::<Vec<_>>();
    let (frame, xr, yr) = (numbers("data-frame"), numbers("data-x"), numbers("data-y"));
    let line = &html[html.find("data-label=\"a\" d=\"M").unwrap() + 19..];
    let points: Vec<[f64; 2]> = line[..line.find('"').unwrap()]
        .split(' ')
        .map(|p| p.split_once(',').unwrap())
        .map(|(x, y)| [x.parse().unwrap(), y.parse().unwrap()])
        .collect();
    for ([px, py], [x, y]) in points.iter().zip([[0.0, 0.0], [5.0, 30.0], [10.0, -10.0]]) {
        let back_x = xr[0] + (px - frame[0]) / (frame[2] - frame[0]) * (xr[1] - xr[0]);
        let back_y = yr[1] - (py - frame[1]) / (frame[3] - frame[1]) * (yr[1] - yr[0]);
        assert!((back_x - x).abs() < 0.01 && (back_y - y).abs() < 0.02, "{back_x} {back_y}");
    }
}

#[test]
fn odd_data_still_makes_a_page() {
    let nan = f64::NAN;
    let axes = || (Axis::new("x", ""), Axis::new("y", ""));
    let cases: [(&[f64], &[f64]); 7] = [
        (&[], &[]),
        (&[1.0], &[2.0]),
        (&[0.0, 1.0], &[nan, nan]),
        (&[0.0, 1.0], &[f64::INFINITY, 1.0]),
        (&[0.0, 1.0, 2.0], &[-f64::MAX, 0.0, f64::MAX]),
        (&[0.0, 0.0], &[5.0, 5.0]),
        (&[nan, 1.0], &[1e-300, 1e300]),
    ];
    let mut items = Vec::new();
    for (x, y) in cases {
        for style in [Style::Line, Style::Raw, Style::Dashed, Style::Points] {
            let (a, b) = axes();
            items.push(Item::Plot(Plot::new("odd", a, b).with("s", x, y, style)));
        }
    }
    items.push(Item::Table(Table { rows: vec![vec![], vec!["a".into(), "1".into()]], ..Table::default() }));
    items.push(Item::SideView(SideView::new("nothing")));
    let lost = Disc { p: [nan, 0.0, 0.0], radius: 1.0, value: nan };
    let disc = Disc { p: [0.0; 3], radius: 1.0, value: nan };
    items.push(Item::SideView(SideView::new("odd").discs(vec![lost, disc], "v", "m/s")));
    items.push(Item::Text("a < b".into()));
    let html = Report { sections: vec![Section::new("odd", items).collapsed()], ..Report::default() }.html();
    check_whole(&html);
    assert!(html.contains("a &lt; b") && html.contains("<details>"));
}

#[test]
fn a_curve_that_belongs_to_another_has_its_colour() {
    let (x, y) = ([0.0, 1.0], [1.0, 2.0]);
    let svg = Plot::new("p", Axis::new("x", ""), Axis::new("y", ""))
        .with("measured a", &x, &y, Style::Points)
        .with_same_colour("computed a", &x, &y, Style::Line)
        .with("measured b", &x, &y, Style::Points)
        .with_same_colour("computed b", &x, &y, Style::Dashed)
        .svg();
    for part in ["dot f0", "\"line c0\"", "dot f1", "\"line dashed c1\""] {
        assert!(svg.contains(part), "{part} in {svg}");
    }
    assert!(!svg.contains(" c2\"") && !svg.contains(" f2\""));
}

#[test]
fn grains_off_the_plane_and_beside_the_window_are_left_out() {
    let position = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 2.0, 0.5, 0.0, 9.0, 0.0, 0.0];
    let view = SideView::new("v").grains(&position, &[0.1; 4], &[0.0; 12], 0.0).unwrap().window(-0.5, 2.5);
    let html = Report { sections: vec![Section::new("s", vec![Item::SideView(view)])], ..Report::default() }.html();
    assert_eq!(count_discs(&html), 2);
    check_whole(&html);
}

#[test]
fn many_grains_become_one_picture() {
    let n = 20_000;
    let discs = (0..n).map(|i| {
        let p = [f64::from(i % 200) * 0.01, 0.0, f64::from(i / 200) * 0.01];
        Disc { p, radius: 0.005, value: f64::from(i) / f64::from(n) }
    });
    let view = SideView::new("v").discs(discs.collect(), "speed", "m/s");
    let html = Report { sections: vec![Section::new("s", vec![Item::SideView(view)])], ..Report::default() }.html();
    check_whole(&html);
    assert!(html.contains("href=\"data:image/png;base64,iVBORw0KGgo") && count_discs(&html) == 0);
    assert!(html.len() < 400_000, "{}", html.len());
}

#[test]
fn arrays_that_do_not_fit_are_named() {
    let short = SideView::new("v").grains(&[0.0; 3], &[0.1; 2], &[0.0; 6], 0.0).unwrap_err();
    assert!(matches!(short, Error::Length { given: 3, expected: 6, .. }), "{short}");
    let beyond = SideView::new("v").mesh(&[0.0; 9], &[0, 1, 3]).unwrap_err();
    assert!(matches!(beyond, Error::Vertex { vertex: 3, count: 3, .. }), "{beyond}");
    assert!(SideView::new("v").mesh(&[0.0; 9], &[0, 1]).is_err());
}
