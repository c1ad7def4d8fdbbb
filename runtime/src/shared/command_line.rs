//! The command line of a process of several components: `--member COMPONENT OPTIONS ARGUMENTS` for
//! each of them.

use super::ComponentType;
use std::ffi::OsString;
use std::fmt::Write;
use std::time::Duration;

/// Begins the arguments of a component.
const MEMBER: &str = "--member";
/// How long a component may take to end after another one has failed, unless it has its own limit.
const STOP: Duration = Duration::from_secs(3);
/// The longest such limit, in seconds.
const LONGEST_STOP: f64 = 24.0 * 60.0 * 60.0;

/// A component of the command line.
#[derive(Debug)]
pub(super) struct Member {
    pub(super) of: &'static ComponentType,
    /// The names of the components that must be ready before it starts.
    pub(super) after: Vec<String>,
    pub(super) cpu: Vec<u16>,
    pub(super) priority: Option<u8>,
    pub(super) stop: Duration,
    /// The command line of the component.
    pub(super) args: Vec<OsString>,
}

/// The request of the command line.
#[derive(Debug)]
pub(super) enum Invocation {
    Run(Vec<Member>),
    Help,
}

/// Parses the command line. An error says what is allowed.
pub(super) fn parse(
    types: &'static [ComponentType],
    args: impl IntoIterator<Item = OsString>,
) -> Result<Invocation, String> {
    let mut members: Vec<Member> = Vec::new();
    let mut args = args.into_iter().peekable();
    while let Some(arg) = args.next() {
        if arg == "--help" || arg == "-h" {
            return Ok(Invocation::Help);
        }
        if arg != MEMBER {
            return Err(format!(
                "`{}` is not part of a component; begin with {MEMBER} COMPONENT",
                arg.to_string_lossy()
            ));
        }
        let word = text(MEMBER, args.next())?;
        let of = types.iter().find(|of| of.name() == word);
        let mut member = Member {
            of: of.ok_or_else(|| unknown(types, &word))?,
            after: Vec::new(),
            cpu: Vec::new(),
            priority: None,
            stop: STOP,
            args: Vec::new(),
        };
        while let Some(option) = args.next_if(is_option) {
            let option = option.to_string_lossy();
            let value = text(&option, args.next())?;
            member.set(&option, &value)?;
        }
        while let Some(arg) = args.next_if(|arg| arg != MEMBER) {
            member.args.push(arg);
        }
        members.push(member);
    }
    if members.is_empty() {
        return Err(format!(
            "name its components: {MEMBER} COMPONENT …; see --help"
        ));
    }
    Ok(Invocation::Run(members))
}

fn text(option: &str, value: Option<OsString>) -> Result<String, String> {
    let value = value.ok_or_else(|| format!("{option}: a value is missing"))?;
    value
        .into_string()
        .map_err(|value| format!("{option}: `{}` is not UTF-8", value.to_string_lossy()))
}

fn unknown(types: &[ComponentType], word: &str) -> String {
    let names: Vec<&str> = types.iter().map(ComponentType::name).collect();
    let hint = match rc_diagnostics::nearest(word, names.iter().copied()) {
        Some(near) => format!("did you mean `{near}`?"),
        None => format!("there are: {}", names.join(", ")),
    };
    format!("{MEMBER}: `{word}` is not linked into this program; {hint}")
}

fn is_option(arg: &OsString) -> bool {
    ["--after", "--cpu", "--priority", "--stop"]
        .iter()
        .any(|option| arg == option)
}

impl Member {
    fn set(&mut self, option: &str, value: &str) -> Result<(), String> {
        match option {
            "--after" => self.after = value.split(',').map(str::to_owned).collect(),
            "--cpu" => {
                let list = rc_scheduling::read_list(value);
                let wrong = || format!("--cpu takes a list such as 0-3,8, not `{value}`");
                self.cpu = list.ok_or_else(wrong)?.into_iter().collect();
            }
            "--priority" => {
                let priority = value.parse().ok().filter(|n| (1..=99).contains(n));
                let wrong = || format!("--priority takes a number from 1 to 99, not `{value}`");
                self.priority = Some(priority.ok_or_else(wrong)?);
            }
            _ => {
                let seconds = value
                    .parse()
                    .ok()
                    .filter(|s| (0.0..=LONGEST_STOP).contains(s));
                let wrong =
                    || format!("--stop takes seconds, at most {LONGEST_STOP}, not `{value}`");
                self.stop = Duration::from_secs_f64(seconds.ok_or_else(wrong)?);
            }
        }
        Ok(())
    }
}

pub(super) fn help(types: &[ComponentType]) -> String {
    let mut text = format!(
        "Runs these components on threads of one process:\n\n\
         {MEMBER} COMPONENT [--after NAMES] [--cpu LIST] [--priority N] [--stop SECONDS] ARGUMENTS …\n\n\
         \x20 --after NAMES    start when these components of the process are ready: a,b\n\
         \x20 --cpu LIST       the processors of its thread: 0-3,8\n\
         \x20 --priority N     the real-time priority of its thread, 1 to 99\n\
         \x20 --stop SECONDS   how long its end may take after another one has failed (3)\n\
         \x20 ARGUMENTS        those of its own program: {MEMBER} COMPONENT --help\n\n\
         COMPONENT is one of:\n"
    );
    for of in types {
        let _ = writeln!(text, "  {}", of.name());
    }
    text
}
