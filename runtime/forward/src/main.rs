//! `rcforward DESCRIPTION OPTIONS…`: a component that forwards, with the options of any component.

use rc_diagnostics::print;
use rc_forward::Description;
use std::path::Path;
use std::process::ExitCode;

fn main() -> ExitCode {
    let mut args = std::env::args_os().skip(1);
    let Some(path) = args.next() else {
        return refuse(
            "usage: rcforward DESCRIPTION OPTIONS…; rcdeploy starts it for a group with `proxy`",
        );
    };
    let path = Path::new(&path);
    let text = match rc_files::read(path) {
        Ok(text) => text,
        Err(error) => return refuse(&format!("{}: {error}", path.display())),
    };
    match Description::read(&text) {
        Ok(description) => ExitCode::from(rc_forward::run(&description, args)),
        Err(error) => refuse(&format!("{}: {error}", path.display())),
    }
}

fn refuse(reason: &str) -> ExitCode {
    print::error(format_args!("rcforward: error: {reason}"));
    ExitCode::from(2)
}
