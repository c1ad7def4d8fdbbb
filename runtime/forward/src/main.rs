//! `rcforward DESCRIPTION OPTIONS…`: a component that forwards, with the options of any component.
//! The description is a file, or its JSON itself, which begins with `{`.

use rc_diagnostics::print;
use rc_forward::Description;
use std::ffi::OsString;
use std::path::Path;
use std::process::ExitCode;

/// The description of a component that has nothing.
const EMPTY: &str = r#"{"name": "rcforward", "model": "0000000000000000", "middleware": "local",
    "period_ns": 1000000000, "types": [], "slots": [], "routes": []}"#;

fn main() -> ExitCode {
    let all: Vec<OsString> = std::env::args_os().skip(1).collect();
    let is_option = |arg: &OsString| arg.as_encoded_bytes().starts_with(b"-");
    if all.first().is_some_and(is_option) && all.iter().any(|arg| arg == "--probe") {
        return match Description::read(EMPTY) {
            Ok(description) => ExitCode::from(rc_forward::run(&description, all)),
            Err(error) => refuse(&error),
        };
    }
    let mut args = all.into_iter();
    let Some(path) = args.next().filter(|path| !is_option(path)) else {
        return refuse(
            "usage: rcforward DESCRIPTION OPTIONS…; rcdeploy starts it for a group with `proxy` and for `convert via process`",
        );
    };
    let (place, text) = match path.to_str().filter(|text| text.starts_with('{')) {
        Some(text) => ("the description".to_owned(), Ok(text.to_owned())),
        None => (path.display().to_string(), rc_files::read(Path::new(&path))),
    };
    let read = text
        .map_err(|error| error.to_string())
        .and_then(|text| Description::read(&text));
    match read {
        Ok(description) => ExitCode::from(rc_forward::run(&description, args)),
        Err(error) => refuse(&format!("{place}: {error}")),
    }
}

fn refuse(reason: &str) -> ExitCode {
    print::error(format_args!("rcforward: error: {reason}"));
    ExitCode::from(2)
}
