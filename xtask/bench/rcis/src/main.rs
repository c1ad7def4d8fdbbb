//! Cost of a simulated world: sensors, robots, bodies. Argument: a folder for meshes and scenes,
//! in which `ball.obj` is left with 20,000 triangles, for peers.

use innermodel::{Folders, InnerModel};
use innermodel_simulation::{Speed, World};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

type Failure = Box<dyn std::error::Error>;

/// How often each figure is measured; the median is printed.
const BLOCKS: usize = 7;

fn main() -> Result<(), Failure> {
    let folder = std::env::args().nth(1).ok_or("expected a folder")?;
    let folder = PathBuf::from(folder);
    println!("| what | measured |\n|---|---|");
    for rings in [50, 100, 200] {
        rays(&folder, rings)?;
    }
    for beams in [540, 1080, 2160] {
        let us = sweep(&folder, beams)?;
        println!("| a laser of {beams} beams, 20,000 triangles: one sweep | {us:.0} µs |");
    }
    let laser = sweep(&folder, 1080)?;
    for rings in [50, 100, 200] {
        let ms = picture(&folder, rings)?;
        let triangles = 2 * rings * rings;
        println!("| RGBD of 320 × 240 pixels, {triangles} triangles: one picture | {ms:.2} ms |");
    }
    let rgbd = picture(&folder, 100)?;
    let core = laser * 40.0 / 1e6 + rgbd * 15.0 / 1e3;
    println!(
        "| 1080 beams at 40 Hz and RGBD at 15 Hz, 20,000 triangles | {:.1} % of a core |",
        core * 100.0
    );
    for robots in [1, 10, 20, 40] {
        let (still, _) = house(robots, robots, false)?;
        let (us, factor) = house(robots, robots, true)?;
        let (crowded, _) = house(robots, 40, true)?;
        let count = robots as f64;
        println!(
            "| {robots} robots that drive in a hall: one step of 10 ms | {us:.0} µs, {:.1} µs each, of which {:.1} µs without sensors; {:.1} µs each with posts in place of 40 robots; {factor:.0} times real time |",
            us / count,
            still / count,
            crowded / count
        );
    }
    let factor = together(&folder)?;
    println!(
        "| ten robots with lasers of 181 beams at 20 Hz, 1080 beams at 40 Hz and RGBD of 320 × 240 at 15 Hz, 20,000 triangles, in steps of 5 ms | {factor:.1} times real time, {:.1} % of a core |",
        100.0 / factor
    );
    write_ball(&folder, 100)?;
    Ok(())
}

/// The median of a time in seconds.
fn median(mut measure: impl FnMut() -> Result<f64, Failure>) -> Result<f64, Failure> {
    let mut times = Vec::new();
    for _ in 0..BLOCKS {
        times.push(measure()?);
    }
    times.sort_by(f64::total_cmp);
    Ok(times[BLOCKS / 2])
}

/// Writes a ball of 2·n² triangles with the radius 1 as `ball.obj`.
fn write_ball(folder: &Path, n: usize) -> Result<PathBuf, Failure> {
    let mut text = String::new();
    let half = n;
    for row in 0..=half {
        let polar = std::f64::consts::PI * row as f64 / half as f64;
        for column in 0..n {
            let angle = std::f64::consts::TAU * column as f64 / n as f64;
            let (x, z) = (polar.sin() * angle.cos(), polar.sin() * angle.sin());
            writeln!(text, "v {x} {} {z}", polar.cos())?;
        }
    }
    for row in 0..half {
        for column in 0..n {
            let next = (column + 1) % n;
            let at = |row: usize, column: usize| row * n + column + 1;
            let (a, b) = (at(row, column), at(row, next));
            let (c, d) = (at(row + 1, column), at(row + 1, next));
            writeln!(text, "f {a} {b} {c}\nf {b} {d} {c}")?;
        }
    }
    let path = folder.join("ball.obj");
    std::fs::write(&path, text)?;
    Ok(path)
}

/// A world with a ball of 2·n² triangles of 1 m in a hall, and what `inside` adds.
fn world(folder: &Path, n: usize, inside: &str) -> Result<World, Failure> {
    world_in_steps(folder, n, inside, Duration::from_millis(1))
}

fn world_in_steps(folder: &Path, n: usize, inside: &str, step: Duration) -> Result<World, Failure> {
    write_ball(folder, n)?;
    let text = format!(
        r#"<innerModel>
            <plane id="floor" ny="1" py="-1500" size="20000,20000,100" collide="1"/>
            <plane id="north" pz="9000" size="20000,5000,100" collide="1"/>
            <plane id="south" pz="-9000" size="20000,5000,100" collide="1"/>
            <plane id="east" nx="1" px="9000" size="20000,5000,100" collide="1"/>
            <plane id="west" nx="1" px="-9000" size="20000,5000,100" collide="1"/>
            <mesh id="ball" file="ball.obj" scale="1000" collide="1"/>
            {inside}
        </innerModel>"#
    );
    let path = folder.join("scene.xml");
    std::fs::write(&path, text)?;
    let tree = InnerModel::load(&path, &Folders::default())?;
    Ok(World::new(tree, step, 1)?)
}

/// Rays that all meet the ball, as the peer casts them.
fn rays(folder: &Path, n: usize) -> Result<(), Failure> {
    let inside = r#"<transform id="stand" tz="-3000"><laser id="laser" max="90000" angle="0.6" measures="10000"/></transform>"#;
    let mut world = world(folder, n, inside)?;
    let seconds = median(|| {
        world.step()?;
        let start = Instant::now();
        let scan = world.scan("laser")?;
        let took = start.elapsed().as_secs_f64();
        assert!(scan.ranges.iter().all(|range| range.distance < 3100.0));
        Ok(took)
    })?;
    let triangles = 2 * n * n;
    println!(
        "| a ray that meets a mesh of {triangles} triangles | {:.0} ns |",
        seconds * 1e5
    );
    Ok(())
}

/// A sweep all around between ball and walls, in µs.
fn sweep(folder: &Path, beams: usize) -> Result<f64, Failure> {
    let inside = format!(
        r#"<transform id="stand" tz="-3000"><laser id="laser" max="30000" angle="6.28" measures="{beams}"/></transform>"#
    );
    let mut world = world(folder, 100, &inside)?;
    let seconds = median(|| {
        world.run(20)?;
        let start = Instant::now();
        for _ in 0..20 {
            world.step()?;
            world.scan("laser")?;
        }
        Ok(start.elapsed().as_secs_f64() / 20.0)
    })?;
    Ok(seconds * 1e6)
}

/// A picture of ball and walls, in ms.
fn picture(folder: &Path, n: usize) -> Result<f64, Failure> {
    let inside = r#"<transform id="stand" tz="-3000" ty="300"><rgbd id="eye" width="320" height="240" focal="280"/></transform>"#;
    let mut world = world(folder, n, inside)?;
    let seconds = median(|| {
        let start = Instant::now();
        for _ in 0..10 {
            world.step()?;
            world.picture("eye")?;
        }
        Ok(start.elapsed().as_secs_f64() / 10.0)
    })?;
    Ok(seconds * 1e3)
}

/// Robots in rows, each with a laser of 20 Hz, and posts of their size in the places up to `places`.
fn robots(robots: usize, places: usize) -> Result<String, Failure> {
    let mut inside = String::new();
    for robot in 0..places {
        let (x, z) = (
            (robot % 5) as f64 * 1500.0 - 3000.0,
            (robot / 5) as f64 * 1500.0 - 4000.0,
        );
        if robot >= robots {
            write!(
                inside,
                r#"<cylinder id="post{robot}" tx="{x}" tz="{z}" radius="200" length="300" collide="1"/>"#
            )?;
            continue;
        }
        write!(
            inside,
            r#"<differentialrobot id="base{robot}" tx="{x}" tz="{z}" collide="1">
                <cylinder id="hull{robot}" radius="200" length="300" collide="1"/>
                <laser id="laser{robot}" max="10000" angle="3.14" measures="181" rate="20" noise="10"/>
            </differentialrobot>"#
        )?;
    }
    Ok(inside)
}

/// Lets all robots drive circles of 300 mm: no robot meets another one.
fn drive(world: &mut World, robots: usize) -> Result<(), Failure> {
    for robot in 0..robots {
        let speed = Speed {
            advance: 300.0,
            turn: 1.0,
            side: 0.0,
        };
        world.drive(&format!("base{robot}"), speed)?;
    }
    Ok(())
}

/// How much faster than real time a world with all of it is, whose sensors are read at their rates.
fn together(folder: &Path) -> Result<f64, Failure> {
    let inside = format!(
        r#"{}<transform id="stand" tz="3000"><laser id="scanner" max="30000" angle="6.28" measures="1080" rate="40"/>
        <transform id="up" ty="300" ry="3.14159"><rgbd id="eye" width="320" height="240" focal="280" rate="15"/></transform></transform>"#,
        robots(10, 10)?
    );
    let mut world = world_in_steps(folder, 100, &inside, Duration::from_millis(5))?;
    drive(&mut world, 10)?;
    let (mut pictures, mut last) = (0, 0);
    let seconds = median(|| {
        let start = Instant::now();
        for _ in 0..200 {
            world.step()?;
            if world.steps() % 5 == 0 {
                world.scan("scanner")?;
            }
            if world.steps() % 10 == 0 {
                for robot in 0..10 {
                    world.scan(&format!("laser{robot}"))?;
                }
            }
            let frame = (world.time().as_secs_f64() * 15.0 + 1e-6) as u64;
            if frame > last {
                (last, pictures) = (frame, pictures + 1);
                world.picture("eye")?;
            }
        }
        Ok(start.elapsed().as_secs_f64())
    })?;
    assert_eq!(pictures, BLOCKS * 15);
    Ok(1.0 / seconds)
}

/// Robots that drive among posts, whose lasers are read or not; one step in µs, and how much faster
/// than real time.
fn house(count: usize, places: usize, reads: bool) -> Result<(f64, f64), Failure> {
    let inside = robots(count, places)?;
    let text = format!(
        r#"<innerModel><plane id="north" pz="9000" size="20000,5000,100" collide="1"/>
            <plane id="east" nx="1" px="9000" size="20000,5000,100" collide="1"/>{inside}</innerModel>"#
    );
    let step = Duration::from_millis(10);
    let mut world = World::new(InnerModel::parse(&text)?, step, 1)?;
    drive(&mut world, count)?;
    let seconds = median(|| {
        let start = Instant::now();
        for _ in 0..200 {
            world.step()?;
            if reads && world.steps() % 5 == 0 {
                for robot in 0..count {
                    world.scan(&format!("laser{robot}"))?;
                }
            }
        }
        Ok(start.elapsed().as_secs_f64() / 200.0)
    })?;
    Ok((seconds * 1e6, step.as_secs_f64() / seconds))
}
