//! The policy of the avoider in the house that is shipped, for minutes of simulated time.

use crate::lidar::Lidar;
use crate::world::{Robot, Simulation, Speed};
use avoider::policy::{Measure, Settings, Side, cruise, is_clear, is_clear_again};
use planar_map::{Map, Point};
use std::collections::HashSet;
use std::f64::consts::PI;
use std::path::Path;

/// 150 s of simulated time.
const STEPS: u32 = 3000;

const SETTINGS: Settings = Settings {
    safe_distance: 700.0,
    speed: 400.0,
    turn_speed: 0.8,
};

fn house(seed: i64) -> Simulation {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../maps/house.map");
    let map = Map::load(Path::new(file)).unwrap();
    let lidar = Lidar {
        beams: 181,
        field_of_view: PI,
        max_range: 5000.0,
        noise: 10.0,
    };
    let robot = Robot {
        radius: 200.0,
        fastest: Speed {
            advance: 1000.0,
            turn: 3.0,
        },
        lidar,
    };
    Simulation::new(&map, robot, 0.05, seed).unwrap()
}

/// One step as the two components make it, in lockstep.
fn step(simulation: &mut Simulation, turning: &mut Option<Side>) {
    let scan: Vec<Measure> = simulation
        .scan()
        .iter()
        .map(|beam| Measure {
            angle: beam.angle as f32,
            distance: beam.distance as f32,
        })
        .collect();
    let clear = match turning {
        None => is_clear(&scan, &SETTINGS),
        Some(_) => is_clear_again(&scan, &SETTINGS),
    };
    let motion = if clear {
        *turning = None;
        cruise(&scan, &SETTINGS)
    } else {
        let side = turning.get_or_insert_with(|| Side::freer(&scan));
        side.turn(&SETTINGS)
    };
    simulation.ask(Speed {
        advance: f64::from(motion.advance),
        turn: f64::from(motion.turn),
    });
    simulation.step();
}

/// The rooms of the house by their corners.
fn room(at: Point) -> usize {
    if at.y < 2300.0 {
        usize::from(at.x > 4600.0)
    } else if at.y < 3700.0 {
        2
    } else {
        3 + usize::from(at.x > 4000.0)
    }
}

#[test]
fn the_avoider_patrols_the_house_and_touches_nothing() {
    for seed in 1..=2 {
        let (mut simulation, mut turning) = (house(seed), None);
        let (mut way, mut rooms, mut halts) = (0.0, HashSet::new(), 0);
        let mut nearest = f64::INFINITY;
        for _ in 0..STEPS {
            let before = simulation.pose;
            step(&mut simulation, &mut turning);
            let moved = before.point().distance_to(simulation.pose.point());
            way += moved;
            halts = if moved < 1.0 { halts + 1 } else { 0 };
            assert!(
                halts < 200,
                "seed {seed}: 10 s without moving at {:?}",
                simulation.pose
            );
            nearest = nearest.min(simulation.clearance(simulation.pose.point()));
            rooms.insert(room(simulation.pose.point()));
        }
        assert!(nearest > 200.0, "seed {seed}: the robot touched a wall");
        assert!(way > 40_000.0, "seed {seed}: only {way:.0} mm in 150 s");
        assert!(rooms.len() >= 3, "seed {seed}: only rooms {rooms:?}");
    }
}

#[test]
fn two_runs_are_equal_to_the_last_bit() {
    let run = || {
        let (mut simulation, mut turning) = (house(1), None);
        (0..500).for_each(|_| step(&mut simulation, &mut turning));
        [
            simulation.pose.x,
            simulation.pose.y,
            simulation.pose.heading,
        ]
        .map(f64::to_bits)
    };
    assert_eq!(run(), run());
}
