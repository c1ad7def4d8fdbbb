//! The memory of one more slot of a component: private and shared.

use crate::pair::Network;
use crate::programs::{Failure, Program, target};
use crate::usage::{own_memory, shared_memory};
use bench_protocol::slots::Role;
use std::time::Duration;

/// Slots of the small and of the large program. The cost of a slot follows from their difference.
const COUNTS: [usize; 2] = [1, 17];
/// The limit for each step of such a program.
const LIMIT: Duration = Duration::from_secs(20);
/// Both sides of a connection: the one that starts first, and the other.
const SIDES: [[Role; 2]; 2] = [
    [Role::Publishers, Role::Subscribers],
    [Role::Servers, Role::Clients],
];

/// The program that opens the slots.
#[derive(Clone, Copy)]
enum Maker {
    Generated,
    ByHand,
}

/// Private memory of the process and shared memory of the network, in kB.
#[derive(Clone, Copy, Default)]
struct Cost {
    own: f64,
    shared: f64,
}

/// Measures and prints the table.
pub(crate) fn table() -> Result<(), Failure> {
    println!(
        "| memory of one more slot, kB | generated: own | shared | by hand: own | shared |\n|---|---|---|---|---|"
    );
    for sides in SIDES {
        let ours = slots(Maker::Generated, sides)?;
        let theirs = slots(Maker::ByHand, sides)?;
        for ((role, a), b) in sides.iter().zip(ours).zip(theirs) {
            println!(
                "| {role} | {:.0} | {:.0} | {:.0} | {:.0} |",
                a.own, a.shared, b.own, b.shared
            );
        }
    }
    println!();
    Ok(())
}

/// The memory of one more slot on each side.
fn slots(maker: Maker, sides: [Role; 2]) -> Result<[Cost; 2], Failure> {
    let few = connected(maker, sides, COUNTS[0])?;
    let many = connected(maker, sides, COUNTS[1])?;
    let more = (COUNTS[1] - COUNTS[0]) as f64;
    let each = |few: Cost, many: Cost| Cost {
        own: (many.own - few.own) / more,
        shared: (many.shared - few.shared) / more,
    };
    Ok([each(few[0], many[0]), each(few[1], many[1])])
}

/// The memory of programs with `count` slots. The shared memory of the first side is measured
/// before the second starts; that of the second is the increase after one message on each slot.
fn connected(maker: Maker, sides: [Role; 2], count: usize) -> Result<[Cost; 2], Failure> {
    let network = Network::new("slots")?;
    let mut first = start(maker, &network, sides[0], count)?;
    let alone = shared_memory(&network.directory);
    let mut second = start(maker, &network, sides[1], count)?;
    // The receiver gets its command first.
    let (receiver, sender) = match sides[0] {
        Role::Publishers | Role::Clients => (&mut second, &mut first),
        Role::Subscribers | Role::Servers => (&mut first, &mut second),
    };
    receiver.write_line("go")?;
    sender.write_line("go")?;
    for program in [receiver, sender] {
        expect(program, "done")?;
    }
    let both = shared_memory(&network.directory);
    Ok([
        Cost {
            own: own_memory(first.pid())? * 1e3,
            shared: alone * 1e3,
        },
        Cost {
            own: own_memory(second.pid())? * 1e3,
            shared: (both - alone) * 1e3,
        },
    ])
}

fn start(maker: Maker, network: &Network, role: Role, count: usize) -> Result<Program, Failure> {
    let folder = target()?.join("release");
    let (role, count) = (role.to_string(), count.to_string());
    let program = match maker {
        Maker::Generated => {
            let arguments = [role.as_str(), &count, &network.name];
            Program::start(&folder.join("bench_slots"), &arguments)?
        }
        Maker::ByHand => {
            let (root, prefix) = network.files()?;
            let arguments = ["hold", &role, &count, &root, &prefix];
            Program::start(&folder.join("bench_peer"), &arguments)?
        }
    };
    expect(&program, "ready")?;
    Ok(program)
}

fn expect(program: &Program, word: &str) -> Result<(), Failure> {
    match program.read_line(LIMIT)?.as_str() {
        line if line == word => Ok(()),
        other => Err(format!("`{other}` instead of `{word}`").into()),
    }
}
