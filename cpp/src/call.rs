//! Calls of functions of the worker.

use crate::border::Bytes;
use crate::status::Answer;
use rc_runtime::Member;

/// The functions of a worker, `enum rc_function` of `abi.h`.
#[derive(Clone, Copy)]
#[repr(i32)]
pub(crate) enum Function {
    /// Makes the worker, sets its parameters and runs `initialize`.
    Initialize,
    Compute,
    SetParameters,
    ParametersChanged,
    Emergency,
    Restore,
    Finalize,
    Transition,
    Error,
    Entry,
    Exit,
    During,
    Guard,
    Action,
    Handle,
    /// Handles a collection.
    Collected,
    /// Handles the end of a started call.
    Ended,
    /// Answers a call of the worker under test.
    Answer,
    /// The worker under test has opened a member of a slot array.
    Opened,
    /// Runs events of the window until a descriptor is readable, at most for some nanoseconds.
    Wait,
    /// Ends the worker.
    End,
}

/// Runs a function of the worker in C++.
pub(crate) type Guest = Box<dyn Fn(&Call<'_>) -> Answer>;

/// A call of a function of the worker.
pub(crate) struct Call<'c> {
    pub(crate) function: Function,
    /// Numbers of a slot and an operation, of a state, of a guard or an action.
    pub(crate) numbers: (usize, usize),
    /// The member of a slot array, or the transition of an error.
    pub(crate) name: &'c str,
    /// The number of the member in its array.
    pub(crate) member: usize,
    pub(crate) body: &'c [u8],
    /// In place of the body, the memory of a sample that the worker may keep by the number `held`.
    pub(crate) image: Option<Bytes>,
    /// The number of a sample or of a started call.
    pub(crate) held: u64,
    /// How a started call has ended: status and number, as of an answer.
    pub(crate) ended: (i32, i64),
    /// Whether a good answer has bytes that are needed.
    pub(crate) has_reply: bool,
}

impl Call<'static> {
    pub(crate) fn of(function: Function) -> Self {
        Self::numbered(function, 0)
    }

    pub(crate) fn numbered(function: Function, number: u16) -> Self {
        Self {
            function,
            numbers: (number.into(), 0),
            name: "",
            member: 0,
            body: &[],
            image: None,
            held: 0,
            ended: (0, 0),
            has_reply: false,
        }
    }
}

impl<'c> Call<'c> {
    /// A call for a slot, or for the member of an array.
    pub(crate) fn of_slot(
        function: Function,
        numbers: (usize, usize),
        member: Option<&'c Member>,
    ) -> Self {
        Call {
            numbers,
            name: member.map_or("", Member::name),
            member: member.map_or(0, Member::index),
            ..Call::of(function)
        }
    }
}
