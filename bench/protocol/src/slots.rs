//! What the programs that hold many ports of one kind say, over pipes: `ready` when all are open;
//! to `go`, which lets each port send or receive one message, `done`. The end of its standard input
//! ends such a program.

use std::fmt::{self, Display};
use std::io::{self, BufRead as _};
use std::str::FromStr;
use std::time::{Duration, Instant};

/// Bytes of a message.
pub const SIZE: usize = 64;
/// How long all ports together may wait for their message.
const LIMIT: Duration = Duration::from_secs(5);
/// Between two looks at a port.
const LOOK: Duration = Duration::from_millis(1);

/// Anything that goes wrong ends such a program.
pub type Failure = Box<dyn std::error::Error>;

/// What a program holds.
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

/// Holds what is open until the standard input ends, and does `exchange` as often as it is told.
pub fn hold(mut exchange: impl FnMut() -> Result<(), Failure>) -> Result<(), Failure> {
    crate::ready()?;
    for line in io::stdin().lock().lines() {
        if line? != "go" {
            return Err("only `go` can be told".into());
        }
        exchange()?;
        crate::say("done\n")?;
    }
    Ok(())
}

/// Lets each of `ports` take one message; `take` says whether there was one.
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
