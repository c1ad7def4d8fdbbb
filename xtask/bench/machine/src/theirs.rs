//! The machines of `ours`, with `statig`. It has no regions: two machines take the event one after the
//! other.

use crate::Stepped;
use statig::Outcome;
use statig::blocking::{IntoStateMachine, IntoStateMachineExt, State, StateMachine, Superstate};

/// The only event.
pub(crate) struct Next;

/// Counts entries and exits.
#[derive(Default)]
pub(crate) struct Counts {
    entries: u64,
    exits: u64,
}

/// A ring of 20 states.
pub(crate) struct Flat(StateMachine<Ring>);

#[derive(Default)]
pub(crate) struct Ring(Counts);

/// The number of the state. Each is a variant, because `statig` distinguishes states by their
/// variants.
macro_rules! ring {
    ($($state:ident => $next:ident),*) => {
        pub(crate) enum RingState { $($state),* }

        impl State<Ring> for RingState {
            fn call_handler(&mut self, _: &mut Ring, _: &Next, (): &mut ()) -> Outcome<Self> {
                match self {
                    $(Self::$state => Outcome::Transition(Self::$next)),*
                }
            }

            fn call_entry_action(&mut self, ring: &mut Ring, (): &mut ()) {
                ring.0.entries += 1;
            }

            fn call_exit_action(&mut self, ring: &mut Ring, (): &mut ()) {
                ring.0.exits += 1;
            }
        }
    };
}

ring!(
    S0 => S1, S1 => S2, S2 => S3, S3 => S4, S4 => S5, S5 => S6, S6 => S7, S7 => S8, S8 => S9,
    S9 => S10, S10 => S11, S11 => S12, S12 => S13, S13 => S14, S14 => S15, S15 => S16, S16 => S17,
    S17 => S18, S18 => S19, S19 => S0
);

pub(crate) enum NoSuperstate {}

impl Superstate<Ring> for NoSuperstate {
    fn call_handler(&mut self, _: &mut Ring, _: &Next, (): &mut ()) -> Outcome<RingState> {
        match *self {}
    }
}

impl IntoStateMachine for Ring {
    type State = RingState;
    type Superstate<'sub> = NoSuperstate;
    type Event<'event> = Next;
    type Context<'context> = ();

    fn initial() -> RingState {
        RingState::S0
    }
}

impl Flat {
    pub(crate) fn new() -> Self {
        Self(Ring::default().state_machine())
    }
}

impl Stepped for Flat {
    fn step(&mut self) {
        self.0.handle(&Next);
    }

    fn entries(&self) -> u64 {
        self.0.inner().0.exits
    }
}

/// Two regions of five levels.
pub(crate) struct Nested([StateMachine<Levels>; 2]);

/// A region. With `all`, all levels change, else the innermost.
pub(crate) struct Levels {
    all: bool,
    counts: Counts,
}

/// The innermost states: two in one branch, and one in another.
pub(crate) enum LevelState {
    X,
    Y,
    Other,
}

/// The four levels around them, in two branches.
pub(crate) enum Level {
    X1,
    X2,
    X3,
    X4,
    Y1,
    Y2,
    Y3,
    Y4,
}

impl State<Levels> for LevelState {
    fn call_handler(&mut self, levels: &mut Levels, _: &Next, (): &mut ()) -> Outcome<Self> {
        Outcome::Transition(match self {
            Self::X if levels.all => Self::Other,
            Self::X => Self::Y,
            Self::Y | Self::Other => Self::X,
        })
    }

    fn call_entry_action(&mut self, levels: &mut Levels, (): &mut ()) {
        levels.counts.entries += 1;
    }

    fn call_exit_action(&mut self, levels: &mut Levels, (): &mut ()) {
        levels.counts.exits += 1;
    }

    fn superstate(&mut self) -> Option<Level> {
        Some(match self {
            Self::X | Self::Y => Level::X4,
            Self::Other => Level::Y4,
        })
    }
}

impl Superstate<Levels> for Level {
    fn call_handler(&mut self, _: &mut Levels, _: &Next, (): &mut ()) -> Outcome<LevelState> {
        Outcome::Super
    }

    fn call_entry_action(&mut self, levels: &mut Levels, (): &mut ()) {
        levels.counts.entries += 1;
    }

    fn call_exit_action(&mut self, levels: &mut Levels, (): &mut ()) {
        levels.counts.exits += 1;
    }

    fn superstate(&mut self) -> Option<Level> {
        match self {
            Self::X1 | Self::Y1 => None,
            Self::X2 => Some(Self::X1),
            Self::X3 => Some(Self::X2),
            Self::X4 => Some(Self::X3),
            Self::Y2 => Some(Self::Y1),
            Self::Y3 => Some(Self::Y2),
            Self::Y4 => Some(Self::Y3),
        }
    }
}

impl IntoStateMachine for Levels {
    type State = LevelState;
    type Superstate<'sub> = Level;
    type Event<'event> = Next;
    type Context<'context> = ();

    fn initial() -> LevelState {
        LevelState::X
    }
}

impl Nested {
    pub(crate) fn new(all: bool) -> Self {
        let region = || {
            let counts = Counts::default();
            Levels { all, counts }.state_machine()
        };
        Self([region(), region()])
    }
}

impl Stepped for Nested {
    fn step(&mut self) {
        for region in &mut self.0 {
            region.handle(&Next);
        }
    }

    fn entries(&self) -> u64 {
        self.0
            .iter()
            .map(|region| region.inner().counts.exits)
            .sum()
    }
}
