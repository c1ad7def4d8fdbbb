//! The protocol of the programs that hold many ports of one kind, over pipes. They print `ready`
//! when all ports are open. On `go` each port sends or receives one message, then they print
//! `done`. They end with their standard input.

use std::fmt::{self, Display};
use std::io::{self, BufRead as _};
use std::str::FromStr;
use std::time::{Duration, Instant};

/// The size of a message, in bytes.
pub const SIZE: usize = 64;
/// The limit until all ports have their message.
const LIMIT: Duration = Duration::from_secs(5);
/// The interval of polling a port.
const LOOK: Duration = Duration::from_millis(1);

/// Any error ends the program.
pub type Failure = Box<dyn std::error::Error>;

/// The kind of the ports.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[expect(missing_docs, reason = "the names say it")]
pub enum Role {
    Publishers,
    Subscribers,
    Servers,
    Clients,
}

impl Display for Role {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Publishers => "publishers",
            Self::Subscribers => "subscribers",
            Self::Servers => "servers",
            Self::Clients => "clients",
        })
    }
}

impl FromStr for Role {
    type Err = io::Error;

    fn from_str(word: &str) -> Result<Self, Self::Err> {
        let all = [
            Self::Publishers,
            Self::Subscribers,
            Self::Servers,
            Self::Clients,
        ];
        let found = all.into_iter().find(|role| role.to_string() == word);
        found.ok_or_else(|| io::Error::other(format!("there is no role `{word}`")))
    }
}

/// Runs `exchange` for each `go`, until the standard input ends.
pub fn hold(mut exchange: impl FnMut() -> Result<(), Failure>) -> Result<(), Failure> {
    crate::ready()?;
    for line in io::stdin().lock().lines() {
        if line? != "go" {
            return Err("the only command is `go`".into());
        }
        exchange()?;
        crate::print_line("done\n")?;
    }
    Ok(())
}

/// Waits until each of `ports` has taken one message. `take` returns whether there was one.
pub fn each<P>(
    ports: &mut [P],
    mut take: impl FnMut(&mut P) -> Result<bool, Failure>,
) -> Result<(), Failure> {
    let end = Instant::now() + LIMIT;
    for port in ports {
        while !take(port)? {
            if Instant::now() > end {
                return Err(format!("no message within {LIMIT:?}").into());
            }
            std::thread::sleep(LOOK);
        }
    }
    Ok(())
}
