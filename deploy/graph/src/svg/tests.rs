//! Properties of every picture, checked on random networks with arbitrary names and messages.

use super::draw;
use crate::model::{Component, Finding, Graph, Group, Slot};
use arbtest::arbitrary::{Result, Unstructured};
use arbtest::arbtest;
use rc_deploy_network::topology::{Connection, End, Host, Kind};
use rc_drawing::width;
use rc_vocabulary::Role;
use roxmltree::{Document, Node};

const WORDS: [&str; 6] = [
    "arm",
    "b",
    "a_very_long_name_of_a_component",
    "<&\"'>",
    "größe",
    "目",
];

fn network(u: &mut Unstructured<'_>) -> Result<Graph> {
    let host = |name: &&str| Host {
        name: (*name).to_owned(),
        address: "10.0.0.2".to_owned(),
        user: Some("pi".to_owned()),
        build: None,
    };
    let names = ["localhost", "robot", "station"];
    let hosts: Vec<Host> = names[..u.int_in_range(1..=3)?].iter().map(host).collect();
    let mut groups: Vec<Group> = Vec::new();
    for number in 0..u.int_in_range(0..=4)? {
        let parent = match groups.len() {
            0 => None,
            some => groups
                .get(u.int_in_range(0..=some)?)
                .map(|g| g.name.clone()),
        };
        let own = format!("{}{number}", u.choose(&WORDS)?);
        groups.push(Group {
            name: parent
                .as_ref()
                .map_or(own.clone(), |p| format!("{p}.{own}")),
            parent,
            exports: Vec::new(),
        });
    }
    let mut components = Vec::new();
    for number in 0..u.int_in_range(0..=15)? {
        let group = groups
            .get(u.int_in_range(0..=groups.len())?)
            .map(|g| g.name.clone());
        let own = format!("{}{number}", u.choose(&WORDS)?);
        let mut slots = Vec::new();
        for _ in 0..u.int_in_range(0..=5)? {
            slots.push(Slot {
                name: (*u.choose(&WORDS)?).to_owned(),
                interface: format!("M::{}", u.choose(&WORDS)?),
                role: *u.choose(&Role::ALL)?,
                middleware: "iceoryx2",
                optional: *u.choose(&[false, true])?,
            });
        }
        components.push(Component {
            name: group.as_ref().map_or(own.clone(), |g| format!("{g}.{own}")),
            component: Some((*u.choose(&WORDS)?).to_owned()),
            group,
            host: u.choose(&hosts)?.name.clone(),
            process: None,
            middleware: "iceoryx2",
            clock: u.choose(&["system", "simulated", "source", "ros"])?,
            external: *u.choose(&[false, false, true])?,
            live: None,
            machine: None,
            slots,
        });
    }
    let connections = connections(u, &components)?;
    let mut findings = Vec::new();
    for _ in 0..u.int_in_range(0..=6)? {
        findings.push(Finding {
            code: "no-provider",
            severity: u.choose(&["error", "warning", "note"])?,
            message: u.choose(&WORDS)?.repeat(u.int_in_range(1..=60)?),
            help: Some("<do> something".to_owned()),
            file: "a.ddsl".into(),
            line: 1,
            column: 2,
            components: Vec::from_iter(components.first().map(|c: &Component| c.name.clone())),
            slots: Vec::from_iter(connections.first().map(|c: &Connection| c.from.clone())),
            connections: (0..connections.len())
                .take(u.int_in_range(0..=3)?)
                .collect(),
            group: groups.last().map(|g| g.name.clone()),
            host: Some(hosts[0].name.clone()),
        });
    }
    Ok(Graph {
        network: "n".to_owned(),
        ddsl: "a.ddsl".into(),
        hosts,
        time: components.first().map(|c| c.name.clone()),
        groups,
        components,
        chains: Vec::new(),
        connections,
        findings,
    })
}

fn connections(u: &mut Unstructured<'_>, components: &[Component]) -> Result<Vec<Connection>> {
    let mut ends: [Vec<(usize, End)>; 4] = Default::default();
    for (at, component) in components.iter().enumerate() {
        for (number, slot) in component.slots.iter().enumerate() {
            let role = Role::ALL.iter().position(|r| *r == slot.role).unwrap_or(0);
            let end = End {
                component: component.name.clone(),
                slot: slot.name.clone(),
                external: component.external,
                at: (at, number),
            };
            ends[role].push((at, end));
        }
    }
    let mut connections: Vec<Connection> = Vec::new();
    for (kind, from, to) in [(Kind::Call, 1, 0), (Kind::Topic, 2, 3)] {
        if ends[from].is_empty() || ends[to].is_empty() {
            continue;
        }
        for _ in 0..u.int_in_range(0..=12)? {
            let (from, to) = (&u.choose(&ends[from])?.1, &u.choose(&ends[to])?.1);
            if connections.iter().any(|c| (&c.from, &c.to) == (from, to)) {
                continue;
            }
            connections.push(Connection {
                from: from.clone(),
                to: to.clone(),
                interface: "M::I".to_owned(),
                kind,
                middleware: u.choose(&["iceoryx2", "dds", "ros2"])?,
                address: None,
                converts: Vec::new(),
                chains: Vec::new(),
            });
        }
    }
    Ok(connections)
}

fn number(node: Node<'_, '_>, name: &str) -> i32 {
    let value = node.attribute(name).and_then(|v| v.parse().ok());
    value.unwrap_or_else(|| panic!("{name} of {node:?}"))
}

/// The translation of an element's content.
fn moved(node: Node<'_, '_>) -> (i32, i32) {
    let all = node.ancestors().filter_map(|n| n.attribute("transform"));
    let numbers = all.map(|text| {
        let text = text.trim_start_matches("translate(").trim_end_matches(')');
        let (x, y) = text.split_once(' ').expect("two numbers");
        (x.parse::<i32>().expect("x"), y.parse::<i32>().expect("y"))
    });
    numbers.fold((0, 0), |sum, one| (sum.0 + one.0, sum.1 + one.1))
}

/// The start and the end of a text, and its base line.
fn extent(node: Node<'_, '_>) -> (i32, i32, i32) {
    let inherited = node.ancestors().find_map(|n| n.attribute("font-size"));
    let size: f64 = inherited.and_then(|s| s.parse().ok()).expect("a size");
    let bold = node.attribute("font-weight").is_some();
    let wide = width(node.text().unwrap_or_default(), size, bold);
    let (by_x, by_y) = moved(node);
    let x = number(node, "x") + by_x;
    let start = match node.attribute("text-anchor") {
        Some("middle") => x - wide / 2,
        Some("end") => x - wide,
        _ => x,
    };
    (start, start + wide, number(node, "y") + by_y)
}

#[test]
fn every_text_is_inside_the_picture_and_no_box_covers_another() {
    arbtest(|u| {
        let graph = network(u)?;
        let text = draw(&graph);
        let page = Document::parse(&text).expect("XML");
        let root = page.root_element();
        let (wide, high) = (number(root, "width"), number(root, "height"));
        for node in page.descendants().filter(|n| n.has_tag_name("text")) {
            let (start, end, base) = extent(node);
            assert!(
                start >= 0 && end <= wide,
                "{node:?} from {start} to {end} of {wide}"
            );
            assert!(
                base >= 10 && base <= high - 3,
                "{node:?} at {base} of {high}"
            );
        }
        let boxes: Vec<Node<'_, '_>> = page
            .descendants()
            .filter(|n| n.attribute("rx") == Some("4"))
            .collect();
        assert_eq!(boxes.len(), graph.components.len());
        let sides = |node: Node<'_, '_>| {
            let (x, y) = (number(node, "x"), number(node, "y"));
            (x, x + number(node, "width"), y, y + number(node, "height"))
        };
        for (at, one) in boxes.iter().enumerate() {
            let (left, right, top, bottom) = sides(*one);
            for other in &boxes[at + 1..] {
                let (l, r, t, b) = sides(*other);
                assert!(
                    right < l || r < left || bottom < t || b < top,
                    "{one:?} {other:?}"
                );
            }
            // The texts of a component are inside its box.
            let (by, _) = moved(*one);
            let texts = one.parent().into_iter().flat_map(|g| g.children());
            for node in texts.filter(|n| n.has_tag_name("text")) {
                let (start, end, _) = extent(node);
                assert!(start > left + by && end < right + by, "{node:?} in {one:?}");
            }
        }
        Ok(())
    })
    .budget_ms(2_000)
    .size_max(4_000);
}
