//! A network of 100 components, and the time of `rcdeploy check` for it.

use crate::figure::Figure;
use crate::languages::{LIMIT, figure, median};
use crate::programs::{Failure, finish, target};
use std::fs;
use std::path::Path;
use std::process::Command;

/// Checks 100 different components: each has its own description, parameters, configuration and
/// executable.
pub(crate) fn figures() -> Result<Vec<Figure>, Failure> {
    let folder = tempfile::tempdir()?;
    write(folder.path(), &target()?.join("release/pong"))?;
    let measured = median(&mut || {
        let mut command = Command::new(target()?.join("release/rcdeploy"));
        command.current_dir(folder.path());
        command.args(["check", "--format", "short", "hundred.ddsl"]);
        // All executables belong to another component, and the check reports it; only the time
        // counts here.
        let started = std::time::Instant::now();
        let output = finish(command, LIMIT).err().map(|e| e.to_string());
        let took = started.elapsed();
        match output.map(|output| output.matches("error[other-component]").count()) {
            Some(100) => Ok(took),
            other => Err(format!("{other:?} of 100 executables were looked at").into()),
        }
    })?;
    Ok(vec![figure(
        "`rcdeploy check` of 100 different components, 400 connections, with configurations and executables, median of 20",
        measured,
        ("< 100 ms", 100),
    )])
}

fn write(folder: &Path, executable: &Path) -> Result<(), Failure> {
    let mut network = "Deployment hundred {\n".to_owned();
    for number in 0..100 {
        let own = folder.join(format!("c{number}"));
        fs::create_dir_all(own.join("etc"))?;
        fs::copy(executable, own.join("program"))?;
        // The first component requires nothing, so that the requirements have no cycle.
        let requires = match number {
            0 => "",
            _ => "requires Laser as scanner, DifferentialRobot as base;",
        };
        fs::write(
            own.join("c.cdsl"),
            format!(
                "import \"Laser.idsl\"; import \"LaserPub.idsl\"; import \"DifferentialRobot.idsl\";\n\
                 import \"FullPoseEstimationPub.idsl\";\n\
                 Component c{number} {{ Communications {{ implements Laser, DifferentialRobot; {requires}\n\
                 publishes FullPoseEstimationPub, LaserPub; subscribesTo FullPoseEstimationPub as pose, LaserPub as scan; }};\n\
                 language rust; parameters \"c.pdsl\"; }};\n"
            ),
        )?;
        fs::write(
            own.join("c.pdsl"),
            format!(
                "ComponentParams c{number} {{ speed float 100 0:1000 T; distance int 5 0:10;\n\
                 group limits {{ low int 1; high int 5; }};\n\
                 list motors 0:8 {{ id int 0 0:127; max float 1.0; }};\n\
                 require limits.low < limits.high \"low is below high\"; }};\n"
            ),
        )?;
        fs::write(
            own.join("etc/config.toml"),
            "[component]\nperiod = \"50ms\"\n\n[parameters]\nspeed = 10.0\ndistance = 3\n\n\
             [parameters.limits]\nlow = 1\nhigh = 7\n\n[[parameters.motors]]\nid = 3\nmax = 2.0\n",
        )?;
        network += &format!(
            "Component c{number} {{ cdsl \"c{number}/c.cdsl\"; executable \"c{number}/program\"; }};\n"
        );
        if number > 0 {
            let before = number - 1;
            network += &format!(
                "bind c{number}.scanner -> c{before}.Laser; bind c{number}.base -> c{before}.DifferentialRobot;\n"
            );
        }
        let next = (number + 1) % 100;
        network += &format!(
            "bind c{number}.pose -> c{next}.FullPoseEstimationPub; bind c{number}.scan -> c{next}.LaserPub;\n"
        );
    }
    fs::write(folder.join("hundred.ddsl"), network + "};\n")?;
    Ok(())
}
