//! Simulated worlds.

mod bases;
mod contacts;
mod errors;
mod imagination;
mod imus;
mod people;
mod pictures;
mod ranges;
mod worlds;

use innermodel::InnerModel;
use innermodel_simulation::World;
use std::time::Duration;

/// 10 ms.
const STEP: Duration = Duration::from_millis(10);

fn world(text: &str) -> World {
    let model = InnerModel::parse(text).expect("a right text");
    World::new(model, STEP, 1).expect("a right step")
}

/// A room from −3000 to 3000 along x, 0 to 2500 along y and −2000 to 2000 along z, with `inside`.
fn room(inside: &str) -> String {
    format!(
        r##"<innerModel>
            <plane id="floor" ny="1" py="-50" size="8000,8000,100" texture="#806040" collide="1" allowed="base"/>
            <plane id="ceiling" ny="1" py="2550" size="8000,8000,100" texture="#ffffff" collide="1"/>
            <plane id="east" nx="1" px="3050" py="1250" size="6000,2600,100" texture="#c00000" collide="1"/>
            <plane id="west" nx="1" px="-3050" py="1250" size="6000,2600,100" texture="#00c000" collide="1"/>
            <plane id="north" pz="2050" py="1250" size="8000,2600,100" texture="#0000c0" collide="1"/>
            <plane id="south" pz="-2050" py="1250" size="8000,2600,100" texture="#c0c000" collide="1"/>
            {inside}
        </innerModel>"##
    )
}

/// The distance to the walls of [`room`] from inside, along a direction of length 1.
fn closed_form(from: [f64; 3], way: [f64; 3]) -> f64 {
    let walls = [(-3000.0, 3000.0), (0.0, 2500.0), (-2000.0, 2000.0)];
    let ways = (0..3).filter_map(|axis| {
        let wall = if way[axis] > 0.0 {
            walls[axis].1
        } else {
            walls[axis].0
        };
        (way[axis] != 0.0).then(|| (wall - from[axis]) / way[axis])
    });
    ways.fold(f64::INFINITY, f64::min)
}
