//! A value of every type. The components make the same ones in their languages.

use interfaces::rc_types::{
    Arrays, Bare, Bounded, Broken, Defaults, Dictionaries, Everything, Kind, Names, Numbers,
    Optionals, Picture, Point, Sequences, VeryBroken,
};

/// The least numbers, and nothing in sequences and dictionaries.
pub(crate) const LEAST: i32 = 1;
/// The greatest numbers, and full sequences.
pub(crate) const MOST: i32 = 2;
/// Numbers between, and all optional values.
pub(crate) const SOME: i32 = 3;

fn numbers(which: i32) -> Numbers {
    match which {
        LEAST => Numbers {
            flag: false,
            b: 0,
            s: i16::MIN,
            i: i32::MIN,
            l: i64::MIN,
            f: f32::MIN,
            d: f64::MIN,
            small: i8::MIN,
            positive: 0,
            middle: i16::MIN,
            port: 0,
            large: i32::MIN,
            address: 0,
            huge: i64::MIN,
            mask: 0,
            coarse: f32::from_bits(1),
            fine: f64::from_bits(1),
        },
        MOST => Numbers {
            flag: true,
            b: u8::MAX,
            s: i16::MAX,
            i: i32::MAX,
            l: i64::MAX,
            f: f32::MAX,
            d: f64::MAX,
            small: i8::MAX,
            positive: u8::MAX,
            middle: i16::MAX,
            port: u16::MAX,
            large: i32::MAX,
            address: u32::MAX,
            huge: i64::MAX,
            mask: u64::MAX,
            coarse: f32::INFINITY,
            fine: f64::NEG_INFINITY,
        },
        _ => Numbers {
            flag: true,
            b: 1,
            s: -2,
            i: 3,
            l: -4,
            f: 0.5,
            d: -0.25,
            small: -5,
            positive: 6,
            middle: -7,
            port: 8,
            large: -9,
            address: 10,
            huge: -11,
            mask: 12,
            coarse: 1.5,
            fine: -2.5,
        },
    }
}

pub(crate) fn outline(length: u8) -> Vec<Point> {
    let point = |at| Point {
        x: f32::from(at) + 0.5,
        y: -1e300,
    };
    (0..length).map(point).collect()
}

fn point(x: f32, y: f64) -> Point {
    Point { x, y }
}

fn names() -> Names {
    [(String::new(), 0.0), ("Grüße, 世界".to_owned(), -12.5)].into()
}

fn texts<const N: usize>(texts: [&str; N]) -> [String; N] {
    texts.map(str::to_owned)
}

fn sequences(which: i32) -> Sequences {
    if which == LEAST {
        return Sequences::default();
    }
    let (least, most) = (numbers(LEAST), numbers(MOST));
    Sequences {
        flags: vec![true, false, true],
        bytes: (0..=255).collect(),
        smalls: vec![i8::MIN, 0, i8::MAX],
        shorts: vec![i16::MIN, 0, i16::MAX],
        ports: vec![0, u16::MAX],
        ints: vec![i32::MIN, 0, i32::MAX],
        addresses: vec![0, u32::MAX],
        longs: vec![i64::MIN, 0, i64::MAX],
        masks: vec![0, u64::MAX],
        floats: vec![least.f, 0.5, most.f, least.coarse],
        doubles: vec![least.d, 0.5, most.d, most.fine],
        texts: vec![String::new(), "Grüße, 世界".to_owned(), "x".repeat(1000)],
        kinds: vec![Kind::Person, Kind::Nothing, Kind::Wall, Kind::Door],
        points: outline(100),
        rows: vec![least, most, numbers(SOME)],
        outlines: vec![vec![], outline(3), outline(1)],
        matrix: vec![vec![1.0, 2.0], vec![], vec![3.0]],
        paths: vec![
            vec![],
            vec![texts(["a", "b"]).into(), vec![]],
            vec![texts(["c"]).into()],
        ],
        tables: vec![Names::new(), names()],
    }
}

fn bounded(which: i32) -> Bounded {
    if which == LEAST {
        return Bounded::default();
    }
    Bounded {
        text: "Grüße!".to_owned(),
        bytes: vec![1, 2, 3, 255],
        doubles: vec![0.5, -0.5],
        texts: texts(["four", "üß"]).into(),
        rows: vec![vec![1, 2, 3], vec![-4]],
        kinds: vec![Kind::Door, Kind::Wall],
        outline: outline(3),
    }
}

fn four(points: Vec<Point>) -> [Point; 4] {
    points.try_into().expect("four points")
}

fn arrays(which: i32) -> Arrays {
    if which == LEAST {
        return Arrays::default();
    }
    Arrays {
        flags: [true, false, true],
        bytes: [0, 1, 254, 255],
        smalls: [i8::MIN, i8::MAX],
        shorts: [i16::MIN, i16::MAX],
        ports: [1, u16::MAX],
        ints: [i32::MIN, i32::MAX],
        addresses: [1, u32::MAX],
        longs: [i64::MIN, i64::MAX],
        masks: [1, u64::MAX],
        floats: [0.5, -1.5, 2.5],
        doubles: std::array::from_fn(|at| at as f64 / 4.0),
        texts: texts(["", "Grüße"]),
        words: texts(["four", "ü"]),
        kinds: [Kind::Person, Kind::Door],
        corners: four(outline(4)),
        outlines: [outline(2), vec![]],
        tables: [names(), Names::new()],
    }
}

fn dictionaries(which: i32) -> Dictionaries {
    if which == LEAST {
        return Dictionaries::default();
    }
    Dictionaries {
        by_text: names(),
        by_bool: [(false, "no".to_owned()), (true, "yes".to_owned())].into(),
        by_byte: [(0, 1), (255, -1)].into(),
        by_int8: [(i8::MIN, 1), (i8::MAX, -1)].into(),
        by_short: [(i16::MIN, vec![1, 2]), (i16::MAX, vec![])].into(),
        by_uint16: [(0, Kind::Door), (u16::MAX, Kind::Nothing)].into(),
        by_int: [(i32::MIN, point(1.0, 2.0)), (i32::MAX, Point::default())].into(),
        by_uint32: [(0, outline(3)), (u32::MAX, vec![])].into(),
        by_long: [(i64::MIN, names()), (i64::MAX, Names::new())].into(),
        by_uint64: [(0, true), (u64::MAX, false)].into(),
        by_word: [
            (String::new(), vec![]),
            ("four".to_owned(), texts(["a", "b"]).into()),
        ]
        .into(),
        by_kind: [
            (Kind::Nothing, numbers(LEAST)),
            (Kind::Person, numbers(MOST)),
        ]
        .into(),
    }
}

fn optionals(which: i32) -> Optionals {
    match which {
        LEAST => Optionals::default(),
        // Present, and empty.
        MOST => Optionals {
            flag: Some(false),
            number: Some(0),
            real: Some(0.0),
            text: Some(String::new()),
            kind: Some(Kind::Nothing),
            point: Some(Point::default()),
            floats: Some(vec![]),
            outlines: Some(vec![]),
            names: Some(Names::new()),
        },
        _ => Optionals {
            flag: Some(true),
            number: Some(i64::MIN),
            real: Some(1e-300),
            text: Some("text".to_owned()),
            kind: Some(Kind::Door),
            point: Some(point(1.0, 2.0)),
            floats: Some(vec![0.5, -0.5]),
            outlines: Some(vec![vec![], outline(2)]),
            names: Some(names()),
        },
    }
}

fn defaults(which: i32) -> Defaults {
    if which == LEAST {
        return Defaults::default();
    }
    Defaults {
        flag: false,
        least: -1,
        most: 1,
        real: 0.0,
        text: String::new(),
        word: String::new(),
        kind: Kind::Wall,
        maybe: None,
        point: point(1.0, 1.0),
        none: vec![7],
    }
}

pub(crate) fn sample(which: i32) -> Everything {
    Everything {
        number: which,
        bare: Bare {},
        numbers: numbers(which),
        sequences: sequences(which),
        bounded: bounded(which),
        arrays: arrays(which),
        dictionaries: dictionaries(which),
        optionals: optionals(which),
        defaults: defaults(which),
    }
}

/// The exceptions of `thrown` in Python, except `Gone`.
pub(crate) fn broken() -> Broken {
    Broken::default()
}

pub(crate) fn very_broken() -> VeryBroken {
    VeryBroken {
        what: "Grüße".to_owned(),
        code: i32::MIN,
        trace: outline(2),
        kind: Some(Kind::Door),
        names: names(),
    }
}

/// A picture that travels in place, whose sequences are as full as their number allows.
pub fn picture(number: i64, bytes: usize) -> Picture {
    Picture {
        number,
        flag: number % 2 == 1,
        mask: u64::MAX,
        kind: Kind::Person,
        frame: "Grüße, 世界".to_owned(),
        center: point(f32::MAX, f64::MIN),
        outline: outline((number % 4) as u8),
        pose: [0.5, -1.5, 2.5, f32::INFINITY, f32::MIN, 0.0],
        kinds: [Kind::Door, Kind::Wall],
        corners: four(outline(4)),
        more: vec![Kind::Door; (number % 4) as usize],
        ranges: vec![f64::MAX; (number % 6) as usize],
        data: (0..bytes).map(|at| (at % 251) as u8).collect(),
    }
}
