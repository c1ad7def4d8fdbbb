//! Benchmarks and long tests, which `cargo xtask` runs: `bench` measures, `soak` runs two
//! components for an hour, `chaos` kills processes, `deny` checks the dependencies, `experiment`
//! counts what a developer types.

mod bench;
mod boot;
mod chaos;
mod compare;
mod convert;
mod counts;
mod cpp;
mod cpp_bench;
mod cross;
mod dds;
mod deny;
mod deploy;
mod editor;
mod exact;
mod experiment;
mod figure;
mod fresh;
mod graph;
mod ice;
mod innermodel;
mod kinematics;
mod languages;
mod lockstep;
mod machine;
mod networks;
mod observe;
mod pair;
mod parameters;
mod place;
mod programs;
mod pypi;
mod python;
mod rcis;
mod rclpy;
mod record;
mod replay;
mod restarts;
mod ros2;
mod slots;
mod soak;
mod usage;
mod variant;
mod wake;
mod world;

use programs::Failure;
use rc_deploy_network::Profile;
use soak::SoakMiddleware;
use std::process::ExitCode;

fn main() -> ExitCode {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let outcome = match args.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["bench"] => bench::run(false).map_err(|e| e.to_string()),
        ["bench", "--smoke"] => bench::run(true).map_err(|e| e.to_string()),
        ["bench", "latencies"] => bench::latencies_alone().map_err(|e| e.to_string()),
        ["bench", "--repeat", runs, "--every", minutes]
            if let (Ok(runs @ 1..), Ok(minutes)) = (runs.parse(), minutes.parse::<u64>()) =>
        {
            let pause = std::time::Duration::from_mins(minutes);
            bench::repeated(runs, pause).map_err(|e| e.to_string())
        }
        ["bench", "counts"] => counts::run(false).map_err(|e| e.to_string()),
        ["bench", "counts", "--smoke"] => counts::run(true).map_err(|e| e.to_string()),
        ["bench", "world"] => world::bench(false).map_err(|e| e.to_string()),
        ["bench", "world", "--smoke"] => world::bench(true).map_err(|e| e.to_string()),
        ["soak", "cross"] => cross::soak().map_err(|e| e.to_string()),
        ["soak", "boot"] => boot::soak().map_err(|e| e.to_string()),
        ["soak", "restarts"] => restarts::soak().map_err(|e| e.to_string()),
        ["soak", "cpp"] => cpp::soak().map_err(|e| e.to_string()),
        ["soak", "editor"] => editor::soak(600).map_err(|e| e.to_string()),
        ["soak", "editor", seconds] if let Ok(seconds) = seconds.parse() => {
            editor::soak(seconds).map_err(|e| e.to_string())
        }
        ["soak", "graph"] => graph::soak().map_err(|e| e.to_string()),
        ["soak", "chains"] => fresh::soak("600", None).map_err(|e| e.to_string()),
        ["soak", "chains", seconds] => fresh::soak(seconds, None).map_err(|e| e.to_string()),
        [
            "soak",
            "chains",
            seconds,
            over @ ("iceoryx2" | "dds" | "ros2"),
        ] => fresh::soak(seconds, Some(over)).map_err(|e| e.to_string()),
        ["soak", "world"] => world::soak().map_err(|e| e.to_string()),
        ["bench", "wake"] => wake::run(false).map_err(|e| e.to_string()),
        ["bench", "wake", "--smoke"] => wake::run(true).map_err(|e| e.to_string()),
        ["bench", "place"] => place::run(false).map_err(|e| e.to_string()),
        ["bench", "place", "--build"] => place::build().map_err(|e| e.to_string()),
        ["bench", "place", "--smoke"] => place::run(true).map_err(|e| e.to_string()),
        ["bench", "time"] => lockstep::run(false).map_err(|e| e.to_string()),
        ["bench", "time", "--smoke"] => lockstep::run(true).map_err(|e| e.to_string()),
        ["bench", "kinematics"] => kinematics::run().map_err(|e| e.to_string()),
        ["soak", "kinematics"] => kinematics::soak().map_err(|e| e.to_string()),
        ["bench", "innermodel"] => innermodel::run().map_err(|e| e.to_string()),
        ["bench", "convert"] => convert::run(false).map_err(|e| e.to_string()),
        ["bench", "convert", "--smoke"] => convert::run(true).map_err(|e| e.to_string()),
        ["bench", "graph"] => graph::run().map_err(|e| e.to_string()),
        ["bench", "rcis"] => rcis::run().map_err(|e| e.to_string()),
        ["bench", "fresh"] => fresh::run(false).map_err(|e| e.to_string()),
        ["bench", "fresh", "--smoke"] => fresh::run(true).map_err(|e| e.to_string()),
        ["bench", "machine"] => machine::run().map_err(|e| e.to_string()),
        ["bench", "editor"] => editor::run(false).map_err(|e| e.to_string()),
        ["bench", "editor", "--smoke"] => editor::run(true).map_err(|e| e.to_string()),
        ["bench", "generator"] => bench::generator().map_err(|e| e.to_string()),
        ["bench", "languages"] => bench::languages().map_err(|e| e.to_string()),
        ["chaos", ref rest @ ..] if let Some(orders) = chaos::Orders::parse(rest) => {
            chaos::run(&orders).map_err(|e| e.to_string())
        }
        ["bench", "dds"] => dds::run(bench::BLOCKS, 1.0).map_err(|e| e.to_string()),
        ["bench", "dds", "--smoke"] => dds::run(5, 0.4).map_err(|e| e.to_string()),
        ["bench", "ros2"] => ros2::run(bench::BLOCKS, 1.0)
            .and_then(|()| rclpy::bench(3, 300))
            .map_err(|e| e.to_string()),
        ["bench", "rclpy"] => rclpy::bench(3, 300).map_err(|e| e.to_string()),
        ["bench", "rclpy", "--smoke"] => rclpy::bench(1, 5).map_err(|e| e.to_string()),
        ["bench", "ros2", "--smoke"] => ros2::run(5, 0.4).map_err(|e| e.to_string()),
        ["bench", "observe"] => observe::run(false).map_err(|e| e.to_string()),
        ["bench", "observe", "--smoke"] => observe::run(true).map_err(|e| e.to_string()),
        ["bench", "record"] => record::run(false).map_err(|e| e.to_string()),
        ["bench", "record", "--smoke"] => record::run(true).map_err(|e| e.to_string()),
        ["bench", "record", "exact"] => exact::run(false).map_err(|e| e.to_string()),
        ["bench", "record", "exact", "--smoke"] => exact::run(true).map_err(|e| e.to_string()),
        ["bench", "deploy"] => deploy::run(false).map_err(|e| e.to_string()),
        ["bench", "deploy", "--smoke"] => deploy::run(true).map_err(|e| e.to_string()),
        ["bench", "deploy", "deaths"] => deploy::deaths().map_err(|e| e.to_string()),
        ["deny"] => deny::run(false).map_err(|e| e.to_string()),
        ["deny", "--smoke"] => deny::run(true).map_err(|e| e.to_string()),
        ["experiment"] => experiment::run(false).map_err(|e| e.to_string()),
        ["experiment", "components"] => experiment::components(false).map_err(|e| e.to_string()),
        ["experiment", "components", "--smoke"] => {
            experiment::components(true).map_err(|e| e.to_string())
        }
        ["experiment", "--smoke"] => experiment::run(true).map_err(|e| e.to_string()),
        ["bench", "ice"] => ice::run().map_err(|e| e.to_string()),
        ["soak", "dds", ref rest @ ..]
            if let Some(soak) = soak(SoakMiddleware::Dds, "600", rest) =>
        {
            soak.map_err(|e| e.to_string())
        }
        ["soak", "replay"] => replay::run(3600).map_err(|e| e.to_string()),
        ["soak", "replay", "--smoke"] => replay::smoke().map_err(|e| e.to_string()),
        ["soak", "replay", seconds] if let Ok(seconds @ 1..) = seconds.parse() => {
            replay::run(seconds).map_err(|e| e.to_string())
        }
        ["soak", "rclpy"] => rclpy::soak(600, Profile::Release).map_err(|e| e.to_string()),
        ["soak", "rclpy", "--smoke"] => rclpy::soak(20, Profile::Dev).map_err(|e| e.to_string()),
        ["soak", "rclpy", seconds] if let Ok(seconds) = seconds.parse() => {
            rclpy::soak(seconds, Profile::Release).map_err(|e| e.to_string())
        }
        ["soak", "ros2", ref rest @ ..]
            if let Some(soak) = soak(SoakMiddleware::Ros2, "600", rest) =>
        {
            soak.map_err(|e| e.to_string())
        }
        ["soak", ref rest @ ..]
            if let Some(soak) = soak(SoakMiddleware::Iceoryx2, "3600", rest) =>
        {
            soak.map_err(|e| e.to_string())
        }
        // A step of `cargo xtask test`.
        ["variants"] => variant::build_for_tests().map_err(|e| e.to_string()),
        ["bench", "cpp"] => cpp_bench::run(false).map_err(|e| e.to_string()),
        ["bench", "cpp", "--smoke"] => cpp_bench::run(true).map_err(|e| e.to_string()),
        ["bench", "python"] => python::run(false).map_err(|e| e.to_string()),
        ["bench", "python", "--smoke"] => python::run(true).map_err(|e| e.to_string()),
        ["bench", "parameters"] => bench::parameters().map_err(|e| e.to_string()),
        _ => {
            eprintln!(
                "usage: cargo xtask bench [latencies | --repeat RUNS --every MINUTES | counts [--smoke] | convert [--smoke] | cpp [--smoke] | editor [--smoke] | fresh [--smoke] | generator | kinematics | languages | machine | observe [--smoke] | parameters | place [--smoke] | python [--smoke] | record [exact] [--smoke] | time [--smoke] | wake [--smoke] | world [--smoke] | ice | dds [--smoke] | ros2 [--smoke] | rclpy [--smoke] | deploy [deaths | --smoke] | --smoke] | soak [boot | chains | cpp | cross | dds | editor | graph | kinematics | restarts | ros2 | rclpy | replay | world] [SECONDS | --smoke] | chaos [--kills N | --minutes N | --seconds N] [--seed S] [--smoke] | deny [--smoke] | experiment [components] [--smoke]"
            );
            return ExitCode::from(2);
        }
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            eprintln!("xtask: error: {message}");
            ExitCode::from(3)
        }
    }
}

/// Runs a soak with the arguments `words`; `None` if they are invalid.
fn soak(middleware: SoakMiddleware, usual: &str, words: &[&str]) -> Option<Result<(), Failure>> {
    match *words {
        [] => Some(soak::run(middleware, usual)),
        ["--smoke"] => Some(soak::smoke(middleware)),
        [seconds] if seconds.parse::<u32>().is_ok() => Some(soak::run(middleware, seconds)),
        _ => None,
    }
}
