//! `rcgen export` and `rcgen view` of solvers.

use crate::command_line::{Common, SolverLanguage};
use crate::export::{Request, write};
use crate::reports::{Failure, print, report, unreadable};
use rc_codegen::files::Owner;
use rc_codegen::{FileLoader, Files, export};
use rc_diagnostics::{Diagnostics, SourceMap};
use rc_kinematics::{Cell, Question, Shape};
use rc_robot::Kept;
use serde_json::{Value, json};
use std::path::Path;

/// Writes the solvers of a file as code.
pub(crate) fn export(request: &Request<'_>, language: SolverLanguage) -> Result<(), Failure> {
    let file = request.file;
    if file
        .extension()
        .is_none_or(|ending| ending != "kdsl" && ending != "ilk")
    {
        let message = format!("{} is not a .kdsl or .ilk file", file.display());
        return Err(Failure::Usage(message));
    }
    let cell = load(file, request.common)?;
    let name = file.file_name().unwrap_or_default().to_string_lossy();
    let of = |ending: &str| format!("{}{ending}", cell.name);
    let printed = match language {
        SolverLanguage::Rust => vec![(of(".rs"), "//", rc_kinematics::rust(&cell))],
        SolverLanguage::C => vec![(of(".h"), "//", rc_kinematics::c(&cell))],
        SolverLanguage::Cpp => vec![(of(".hpp"), "//", rc_kinematics::cpp(&cell))],
        SolverLanguage::Python => vec![(of(".py"), "#", rc_kinematics::python(&cell))],
        SolverLanguage::Ctypes => vec![
            (of(".c"), "//", rc_kinematics::library(&cell)),
            (of("_ctypes.py"), "#", rc_kinematics::loader(&cell)),
        ],
        SolverLanguage::Ilk => {
            let files = rc_kinematics::ilk::print(&cell);
            let files = files.map_err(|error| Failure::Usage(error.to_string()))?;
            let files = files.into_iter();
            files.map(|(path, text)| (path, "--", text)).collect()
        }
    };
    let header = export::HEADER;
    let mut files = Files::default();
    for (path, comment, text) in printed {
        files.add(
            path,
            Owner::Exported,
            format!("{comment} {header} from {name}; rewritten at every export.\n{text}"),
        );
    }
    write(&files, request.out, request.dry_run)
}

/// Prints a robot and its solvers as JSON.
pub(crate) fn view(file: &Path, common: &Common) -> Result<(), Failure> {
    let cell = load(file, common)?;
    let robot = &cell.robot;
    let limits = robot.coordinates.iter().zip(robot.limits());
    let joints = limits.map(|(name, limits)| {
        // JSON has no infinity: a missing limit of a joint has no number.
        let number = |value: f64| value.is_finite().then_some(value);
        json!({
            "name": name,
            "lower": limits.and_then(|limits| number(limits.lower)),
            "upper": limits.and_then(|limits| number(limits.upper)),
            "velocity": limits.map(|limits| limits.velocity),
            "effort": limits.map(|limits| limits.effort),
        })
    });
    let loops = cell.loops.iter().map(|own| {
        let frames = own.frames.map(|at| robot.bodies[at].name.as_str());
        let kind = match own.kept {
            Kept::Whole => "fixed",
            Kept::Point => "point",
            Kept::Turning(_) => "revolute",
            Kept::Sliding(_) => "prismatic",
        };
        json!({ "name": own.name, "type": kind, "frames": frames })
    });
    let transmissions = robot.transmissions.iter().map(|own| {
        json!({
            "name": own.name,
            "actuator": own.actuator,
            "joint": robot.coordinates[own.coordinate],
            "reduction": own.reduction,
            "offset": own.offset,
        })
    });
    let solvers = cell.solvers.iter().map(|solver| {
        let work = solver.work();
        let outputs = solver.outputs.iter().map(|output| {
            let shape = match output.shape {
                Shape::Vector(length) => json!([length]),
                Shape::Matrix(rows, columns) => json!([rows, columns]),
            };
            json!({ "name": output.name, "doc": output.doc, "shape": shape })
        });
        json!({
            "name": solver.name,
            "doc": solver.doc,
            "takesVelocities": solver.takes_velocities,
            "takesAccelerations": solver.takes_accelerations,
            "takesEfforts": solver.takes_efforts,
            "outputs": outputs.collect::<Vec<Value>>(),
            "sums": work.sums,
            "products": work.products,
            "functions": work.functions,
            "choices": work.choices,
        })
    });
    let inverses = cell.inverses.iter().map(|inverse| {
        let work = inverse.work();
        let (asked, iterations, beginnings, closed) = match &inverse.asked {
            Question::Pose(search) => (
                "pose",
                search.iterations,
                search.beginnings(),
                search.closed.as_ref().map(|form| form.kind.describe()),
            ),
            Question::Velocity(_) => ("velocity", 1, 1, None),
        };
        let joints = inverse.joints.iter();
        json!({
            "name": inverse.name,
            "doc": inverse.doc,
            "asked": asked,
            "question": inverse.question,
            "joints": joints.map(|at| &robot.coordinates[*at]).collect::<Vec<_>>(),
            "closedForm": closed,
            "mostMotions": iterations * beginnings,
            "sums": work.sums,
            "products": work.products,
            "functions": work.functions,
            "choices": work.choices,
        })
    });
    let all = json!({
        "name": cell.name,
        "robot": robot.name,
        "links": robot.links().map(|(_, name)| name).collect::<Vec<_>>(),
        "joints": joints.collect::<Vec<Value>>(),
        "loops": loops.collect::<Vec<Value>>(),
        "transmissions": transmissions.collect::<Vec<Value>>(),
        "solvers": solvers.collect::<Vec<Value>>(),
        "inverses": inverses.collect::<Vec<Value>>(),
    });
    let text = serde_json::to_string_pretty(&all);
    print(&text.map_err(|e| Failure::System(e.to_string()))?);
    print("\n");
    Ok(())
}

/// The solvers of a file. Its errors are reported.
fn load(file: &Path, common: &Common) -> Result<Cell, Failure> {
    let (mut sources, mut found, mut refused) = (SourceMap::new(), Diagnostics::new(), None);
    let loader = FileLoader::new(&common.include);
    let mut cell = None;
    match rc_files::read(file) {
        Ok(text) => {
            let source = sources.add(file, text);
            let (read, more) = rc_kinematics::load(&mut sources, &loader, source);
            found.extend(more);
            cell = read;
        }
        Err(error) => unreadable(file, &error, &mut sources, &mut found, &mut refused),
    }
    let printed = report(&sources, &found, common.format);
    if let Some(refused) = refused {
        return Err(Failure::System(refused));
    }
    printed?;
    cell.ok_or(Failure::Input)
}
