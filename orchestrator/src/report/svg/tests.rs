//! Charts of made-up data: well formed, bounded, and with nothing that is not a number.

use super::axis::Axis;
use super::heat::{HeatCell, HeatMap, Limit};
use super::legend::{Entry, Sign};
use super::lines::{LineChart, Point, Series};
use super::look::Mark;
use super::number::Unit;
use super::picture::{Panel, Picture, WIDTH};
use super::rows::{Part, Row, RowChart, Spot};
use super::scale::{Bounds, Spread};
use shared_types::wire::StrategyKind;

/// Every number of every path, point and box of a picture, checked to be one.
fn check(picture: &Picture) -> String {
    let text = picture.document();
    let document = roxmltree::Document::parse(&text).expect("well-formed XML");
    let root = document.root_element();
    let size: Vec<f64> =
        root.attribute("viewBox").unwrap().split(' ').map(|part| part.parse().unwrap()).collect();
    assert_eq!(size[..3], [0.0, 0.0, WIDTH]);
    for node in document.descendants().filter(roxmltree::Node::is_element) {
        for name in ["x", "y", "x1", "x2", "y1", "y2", "width", "height", "font-size"] {
            let Some(value) = node.attribute(name) else { continue };
            assert!(value.parse::<f64>().is_ok_and(f64::is_finite), "{name}={value}");
        }
        for number in node.attribute("d").unwrap_or("").split(['M', 'L', 'Z', ' ']) {
            assert!(
                number.is_empty() || number.parse::<f64>().is_ok_and(f64::is_finite),
                "{number}"
            );
        }
    }
    text
}

fn picture(panel: Panel) -> Picture {
    let legend =
        vec![Entry::new(Sign::Fill("tie"), "a tie"), Entry::new(Sign::Limit("2 2"), "<&>")];
    Picture {
        name: "test".to_owned(),
        title: "A \"title\" <&> more".to_owned(),
        about: "About 'it'.".to_owned(),
        legend,
        panels: vec![panel],
        notes: vec!["A note ".repeat(40)],
    }
}

fn point(x: f64, y: f64, interval: Option<(f64, f64)>) -> Point {
    Point { x, y, interval, is_marked: true }
}

fn chart(points: Vec<Point>) -> Panel {
    let x = Bounds::between(Spread::Log, 1.0, 100.0);
    let y = Bounds::between(Spread::Linear, 0.0, 10.0);
    let series = StrategyKind::ALL
        .into_iter()
        .map(|kind| Series {
            mark: Mark::of(kind),
            name: format!("{kind} <&>"),
            points: points.clone(),
            is_reference: kind == StrategyKind::Null,
        })
        .collect();
    Panel::Lines(LineChart {
        title: "chart".to_owned(),
        x: Axis::measured("x", x, Unit::Count),
        y: Axis::measured("y", y, Unit::Time),
        series,
        dodge: 3.0,
        height: 300.0,
    })
}

#[test]
fn labels_are_escaped_and_come_back_whole() {
    let text = check(&picture(chart(vec![point(10.0, 5.0, None)])));
    let document = roxmltree::Document::parse(&text).unwrap();
    let texts: Vec<&str> = document.descendants().filter_map(|node| node.text()).collect();
    assert!(texts.contains(&"A \"title\" <&> more"), "{texts:?}");
    assert!(texts.contains(&"boundary <&>"), "{texts:?}");
}

#[test]
fn values_that_cannot_be_shown_leave_gaps() {
    let wild = vec![
        point(2.0, 1.0, Some((f64::NAN, f64::INFINITY))),
        point(3.0, 2.0, Some((-5.0, f64::INFINITY))),
        point(f64::NAN, 1.0, None),
        point(5.0, f64::NEG_INFINITY, None),
        point(0.0, 1.0, None),
        point(50.0, 1e300, None),
        point(60.0, 9.0, None),
        point(70.0, 9.5, None),
    ];
    let text = check(&picture(chart(wild)));
    let document = roxmltree::Document::parse(&text).unwrap();
    let curves = document.descendants().filter(|node| {
        node.has_tag_name("path") && node.attribute("class") == Some("curve s-boundary")
    });
    assert_eq!(curves.count(), 2, "one line before the gap and one after it");
}

#[test]
fn empty_charts_are_pictures_too() {
    check(&picture(chart(Vec::new())));
    check(&picture(Panel::Rows(RowChart {
        title: String::new(),
        x: Axis::measured("x", Bounds::between(Spread::Linear, 0.0, 1.0), Unit::Plain),
        rows: Vec::new(),
    })));
    let map = HeatMap {
        title: String::new(),
        x_title: "x".to_owned(),
        y_title: "y".to_owned(),
        columns: Vec::new(),
        rows: Vec::new(),
        cells: Vec::new(),
        limits: vec![Limit { dashes: "", points: Vec::new() }],
    };
    check(&picture(Panel::Heat(map)));
    let text = check(&Picture::of_nothing("none", "Nothing", "no data at all"));
    assert!(text.contains(">no data at all</text>"));
}

#[test]
fn rows_end_at_the_axis() {
    let mark = Mark::of(StrategyKind::Full);
    let rows = vec![
        Row { name: "heading".to_owned(), is_heading: true, ..Row::default() },
        Row {
            name: "row".to_owned(),
            parts: vec![Part {
                from: 50.0,
                to: 1e9,
                class: "fill part-1",
                words: "wake".to_owned(),
            }],
            spots: [10.0, 1e9, f64::NAN].map(|x| Spot { x, mark, is_hollow: false }).to_vec(),
            remark: "n 10".to_owned(),
            ..Row::default()
        },
    ];
    let x = Axis::measured("x", Bounds::between(Spread::Linear, 0.0, 100.0), Unit::Percent);
    let text = check(&picture(Panel::Rows(RowChart { title: String::new(), x, rows })));
    let document = roxmltree::Document::parse(&text).unwrap();
    let points =
        document.descendants().filter(|node| node.attribute("class") == Some("point s-full"));
    assert_eq!(points.count(), 1, "only one of the values has a place");
    for node in document.descendants().filter(|node| node.attribute("class") == Some("fill part-1"))
    {
        let of = |name: &str| node.attribute(name).unwrap().parse::<f64>().unwrap();
        assert!(of("x") + of("width") <= WIDTH);
    }
}

#[test]
fn hatched_cells_use_the_pattern_of_their_own_picture() {
    let cell = HeatCell {
        column: 0,
        row: 0,
        class: Some("tint s-full"),
        is_hatched: true,
        words: ["F 1.3".to_owned(), "n 9".to_owned()],
    };
    let map = HeatMap {
        title: "map".to_owned(),
        x_title: "x".to_owned(),
        y_title: "y".to_owned(),
        columns: vec!["2".to_owned()],
        rows: vec!["1".to_owned()],
        cells: vec![cell],
        limits: vec![Limit { dashes: "", points: vec![(0.0, f64::NAN), (0.5, 0.5), (9.0, 9.0)] }],
    };
    let text = check(&picture(Panel::Heat(map)));
    assert!(text.contains("fill:url(#test-hatching)") && text.contains("id=\"test-hatching\""));
}

#[test]
fn the_same_picture_has_the_same_bytes() {
    let one = || picture(chart(vec![point(2.0, 3.0, Some((2.0, 4.0))), point(20.0, 4.0, None)]));
    assert_eq!(one().document(), one().document());
    assert_eq!(one().inline().render(), one().inline().render());
}
