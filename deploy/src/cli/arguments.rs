//! Arguments that several subcommands share.

use super::bag::duration;
use super::completion::{
    components, components_and_groups, managed_components, networks, parameters, topics,
};
use clap::{Args, Subcommand};
use rc_command_line::{files, words};
use rc_deploy_client::Format;
use rc_deploy_export::Engine;
use rc_deploy_network::Profile;
use rc_management::event::parse_time;
use rc_vocabulary::{Middleware, listed};
use std::path::PathBuf;
use std::time::SystemTime;

#[derive(Args)]
pub(super) struct Input {
    /// The network.
    #[arg(value_name = "FILE.ddsl", add = files(&["ddsl"]))]
    pub(super) file: PathBuf,
    /// Searches this folder for imported files, too.
    #[arg(short = 'I', value_name = "DIR")]
    pub(super) include: Vec<PathBuf>,
    /// The profile with which cargo has built the executables: release or dev.
    #[arg(long, default_value = "release", value_parser = |text: &str| text.parse::<Profile>(), add = words(&["release", "dev"]))]
    pub(super) profile: Profile,
    /// Runs all components on this middleware, whatever the files say: iceoryx2, dds or ros2.
    ///
    /// `up --build` builds these variants below target/rc. The folders of components are not
    /// changed.
    #[arg(long, value_parser = middleware, add = words(Middleware::in_files().map(Middleware::word)))]
    pub(super) middleware: Option<Middleware>,
    /// Sets a parameter, as in `--set avoider.speed=300`, whatever the files say.
    #[arg(long, value_name = "COMPONENT.PATH=VALUE")]
    pub(super) set: Vec<String>,
}

impl Input {
    /// A network as its files say it is.
    pub(super) fn of(file: PathBuf, include: Vec<PathBuf>) -> Self {
        Self {
            file,
            include,
            profile: Profile::Release,
            middleware: None,
            set: Vec::new(),
        }
    }

    /// These arguments on another command line, which has another working directory.
    pub(super) fn words(&self) -> std::io::Result<Vec<String>> {
        let whole = |path: &PathBuf| {
            let path = std::path::absolute(path)?;
            let text = path.into_os_string().into_string();
            text.map_err(|path| std::io::Error::other(format!("{} is not UTF-8", path.display())))
        };
        let mut words = vec!["--profile".to_owned(), self.profile.word().to_owned()];
        for include in &self.include {
            words.extend(["-I".to_owned(), whole(include)?]);
        }
        if let Some(middleware) = self.middleware {
            words.extend(["--middleware".to_owned(), middleware.word().to_owned()]);
        }
        for set in &self.set {
            words.extend(["--set".to_owned(), set.clone()]);
        }
        words.extend(["--".to_owned(), whole(&self.file)?]);
        Ok(words)
    }
}

/// Components of a running network.
#[derive(Args)]
pub(super) struct Named {
    /// The network or its .ddsl. Optional if only one network runs.
    #[arg(add = networks())]
    pub(super) network: String,
    /// Components by their full names, or groups.
    #[arg(required = true, value_name = "NAME", add = components_and_groups())]
    pub(super) names: Vec<String>,
    /// The form of the output: human or json (one document).
    #[arg(long, default_value = "human", value_parser = format, add = words(&["human", "json"]))]
    pub(super) format: Format,
}

/// A topic or an operation of a running network.
#[derive(Args)]
pub(super) struct TopicArguments {
    /// The network or its .ddsl. Optional if only one network runs.
    #[arg(add = networks())]
    pub(super) network: String,
    /// COMPONENT.SLOT.OPERATION of one of its ends, its address, or any end of these that means one
    /// thing.
    #[arg(value_name = "TOPIC", add = topics())]
    pub(super) topic: String,
    /// Fails if no message comes for this many seconds. Without it, a finite command waits ten
    /// seconds, others without limit.
    #[arg(long, value_name = "SECONDS", value_parser = seconds)]
    pub(super) timeout: Option<f64>,
    /// The form of the output: human or json (one object a line).
    #[arg(long, default_value = "human", value_parser = format, add = words(&["human", "json"]))]
    pub(super) format: Format,
}

/// Managed components of a running network.
#[derive(Args)]
pub(super) struct Managed {
    /// The network or its .ddsl. Optional if only one network runs.
    #[arg(add = networks())]
    pub(super) network: String,
    /// Components by their full names, or groups. Without them, all managed components.
    #[arg(value_name = "NAME", add = managed_components())]
    pub(super) names: Vec<String>,
    /// The form of the output: human or json (one document).
    #[arg(long, default_value = "human", value_parser = format, add = words(&["human", "json"]))]
    pub(super) format: Format,
}

/// A running component.
#[derive(Args)]
pub(super) struct Running {
    /// The network or its .ddsl. Optional if only one network runs.
    #[arg(add = networks())]
    pub(super) network: String,
    /// The component.
    #[arg(add = components())]
    pub(super) name: String,
    /// The form of the output: human or json (one document).
    #[arg(long, default_value = "human", value_parser = format, add = words(&["human", "json"]))]
    pub(super) format: Format,
}

#[derive(Subcommand)]
pub(super) enum Action {
    /// Shows parameters as `PATH = VALUE`.
    Get {
        #[command(flatten)]
        of: Running,
        /// The parameters, as in `speed` or `motors[2].max`. A group or a list means all its
        /// parameters.
        #[arg(required = true, value_name = "PATH", add = parameters(""))]
        paths: Vec<String>,
    },
    /// Changes parameters, all or none.
    Set {
        #[command(flatten)]
        of: Running,
        /// The changes, as in `speed=300`, `period=200ms`, `gains=[1,2,3]` or `name=left`. The
        /// value `-` of a secret reads a line of standard input. The name of another component
        /// between two changes begins the changes of that one.
        #[arg(required = true, value_name = "PATH=VALUE", value_parser = change_or_name, add = parameters("="))]
        changes: Vec<ChangeOrName>,
    },
    /// Writes changed values into the configuration file. Comments and order are kept.
    Save {
        #[command(flatten)]
        of: Running,
    },
    /// Writes the parameters of all components of a network as one TOML file, without secrets.
    Dump {
        /// The network or its .ddsl. Optional if only one network runs.
        #[arg(add = networks())]
        network: String,
        /// Writes to this file instead of standard output.
        #[arg(short, long, value_name = "FILE.toml", add = files(&["toml"]))]
        output: Option<PathBuf>,
    },
    /// Sets the parameters of a file that `params dump` has written, all or none.
    ///
    /// Components and parameters that the file does not have stay as they are. A parameter that has
    /// the value of the file already is not set.
    Load {
        /// The network or its .ddsl. Optional if only one network runs.
        #[arg(add = networks())]
        network: String,
        /// The file; `-` is standard input.
        #[arg(value_name = "FILE.toml", add = files(&["toml"]))]
        file: PathBuf,
        /// Also saves the values in the configurations of the components, as `params save` does.
        #[arg(long)]
        save: bool,
        /// The form of the output: human or json (one document).
        #[arg(long, default_value = "human", value_parser = format, add = words(&["human", "json"]))]
        format: Format,
    },
}

pub(super) fn switch(text: &str) -> Result<bool, String> {
    match text {
        "on" => Ok(true),
        "off" => Ok(false),
        _ => Err("an emergency is on or off".to_owned()),
    }
}

/// A word of `params set`.
#[derive(Clone, Debug)]
pub(super) enum ChangeOrName {
    /// A path and its value.
    Change(String, String),
    /// The component of the changes that follow.
    Name(String),
}

#[expect(
    clippy::unnecessary_wraps,
    reason = "clap reads a word with a function that may fail"
)]
fn change_or_name(text: &str) -> Result<ChangeOrName, String> {
    Ok(match change(text) {
        Ok((path, value)) => ChangeOrName::Change(path, value),
        Err(_) => ChangeOrName::Name(text.to_owned()),
    })
}

pub(super) fn change(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((path, value)) => Ok((path.trim().to_owned(), value.to_owned())),
        None => Err("a change looks like `speed=300`".to_owned()),
    }
}

fn middleware(text: &str) -> Result<Middleware, String> {
    let mut all = Middleware::in_files();
    let words = all.clone().map(Middleware::word);
    let found = all.find(|middleware| middleware.word() == text);
    found.ok_or_else(|| match rc_diagnostics::nearest(text, words.clone()) {
        Some(near) => format!("did you mean `{near}`?"),
        None => format!("there are {}", listed(words, "and")),
    })
}

pub(super) fn engine(text: &str) -> Result<Engine, String> {
    let words = Engine::WORDS.map(|(word, _)| word);
    let found = Engine::WORDS.into_iter().find(|(word, _)| *word == text);
    found
        .map(|(_, engine)| engine)
        .ok_or_else(|| match rc_diagnostics::nearest(text, words) {
            Some(near) => format!("did you mean `{near}`?"),
            None => format!("there are {}", words.join(", ")),
        })
}

pub(super) fn format(text: &str) -> Result<Format, String> {
    match text {
        "human" => Ok(Format::Human),
        "json" => Ok(Format::Json),
        other => Err(format!(
            "`{other}` is not a format; there are human and json"
        )),
    }
}

/// A time before now, or a time of a log.
pub(super) fn since(text: &str) -> Result<SystemTime, String> {
    if let Some(time) = parse_time(text) {
        return Ok(time);
    }
    let before = duration(text).map_err(|_| {
        "expected a time before now, as in `90s`, `10min` or `2h`, or a time of a log, as in `2026-01-31T12:00:00Z`"
            .to_owned()
    })?;
    let now = SystemTime::now();
    Ok(now.checked_sub(before).unwrap_or(SystemTime::UNIX_EPOCH))
}

/// Seconds of a command line, from a thousandth to a day.
pub(super) fn seconds(text: &str) -> Result<f64, String> {
    let seconds = text.parse().ok().filter(|s| (1e-3..=86_400.0).contains(s));
    seconds.ok_or_else(|| "expected seconds, from 0.001 to 86400".to_owned())
}

/// A rate of a command line.
pub(super) fn rate(text: &str) -> Result<f64, String> {
    let rate = text.parse().ok().filter(|r| (1e-3..=1e5).contains(r));
    rate.ok_or_else(|| "expected times a second, from 0.001 to 100000".to_owned())
}
