//! The functions that a worker reaches through its context. The border calls these on the worker's
//! thread.

use crate::border::Bytes;
use crate::handles::{self, Held, Loan, LoanMemory};
use crate::status::{
    Answer, DONE, EXCEPTION, INTERNAL, INVALID_ARGUMENT, INVALID_SAMPLE, NOT_ENDED, NOT_SENT,
};
use rc_host::bodies::{self, Reply};
use rc_host::{Aligned, HostError, Lent, Number, Program, link, session};
use rc_middleware::{CallError, EncodeError, Encoding, Freshness, Made, Writer};
use rc_runtime::{Order, Time, TimeSource};
use rc_values::{ValueError, check_image, decode, decode_image, encode_body};
use std::cell::RefCell;
use std::sync::Arc;
use std::time::Duration;

thread_local! {
    /// The component of this thread.
    static PROGRAM: RefCell<Option<Arc<Program>>> = const { RefCell::new(None) };
}

/// Makes it the component of this thread.
pub(crate) fn enter(program: &Arc<Program>) {
    PROGRAM.set(Some(Arc::clone(program)));
}

fn program() -> Result<Arc<Program>, HostError> {
    PROGRAM
        .with_borrow(Clone::clone)
        .ok_or(HostError::WrongThread)
}

/// Calls a query, or sends a command.
pub(crate) fn call(slot: usize, operation: usize, body: &[u8]) -> Result<Answer, Answer> {
    let program = program()?;
    let operation = link::operation(&program, slot, operation)?;
    if !operation.wire.two_way {
        bodies::command(slot, operation, body)??;
        return Ok(Answer::number(0));
    }
    Ok(answered(bodies::query(slot, operation, body)??))
}

/// The answer to a query, for the headers.
fn answered(reply: Reply) -> Answer {
    let status = if reply.case == 0 { DONE } else { EXCEPTION };
    Answer::new(status, reply.case.into(), reply.body)
}

fn internal(error: impl std::fmt::Display) -> Answer {
    Answer::new(INTERNAL, 0, error.to_string())
}

/// Starts a query. The number of the answer is that of the call.
pub(crate) fn start(slot: usize, operation: usize, body: &[u8]) -> Result<Answer, Answer> {
    let program = program()?;
    let operation = link::operation(&program, slot, operation)?;
    let call = bodies::start(slot, operation, body)??;
    Ok(held(handles::hold(Held::Call(call))))
}

/// Takes the result of a started call, once. The status `NOT_ENDED`: there is none.
pub(crate) fn take(slot: usize, call: u64) -> Result<Answer, Answer> {
    let taken = session::with(|session| {
        let client = session.client(slot)?;
        Ok(handles::with_call(call, |call| client.take(call)).flatten())
    })?;
    match taken {
        Some(Ok(answer)) => Ok(answer),
        Some(Err(error)) => Err(error.into()),
        None => Ok(Answer::new(NOT_ENDED, 0, [])),
    }
}

/// The answer to a started call, with its exception or error.
pub(crate) fn of_ended(ended: Result<Reply, CallError>) -> Answer {
    match ended {
        Ok(reply) => answered(reply),
        Err(error) => error.into(),
    }
}

/// Success with the number of what the program holds.
fn held(number: u64) -> Answer {
    Answer::number(number.cast_signed())
}

/// Begins a sample that the program writes in place. Returns its memory, too.
pub(crate) fn loan(slot: usize, operation: usize) -> Result<(Answer, Bytes), Answer> {
    /// Addition to the error of a second loan.
    const ONE_LOAN: &str = "send or drop the loan of the topic before the next one";
    let program = program()?;
    let described = link::operation(&program, slot, operation)?;
    let request = Arc::clone(&described.request);
    let layout = request.layout.ok_or_else(|| {
        internal(format!(
            "samples of `{}` are not written in place",
            described.name
        ))
    })?;
    let size = layout.size;
    rc_host::drop_abandoned();
    let lent = session::with(|session| {
        let publisher = session.publisher(slot, operation)?;
        Ok(publisher.loan_image(size))
    })?;
    let lent = lent.map_err(|error| Answer::new(NOT_SENT, 0, format!("{error}; {ONE_LOAN}")))?;
    let (memory, bytes) = if let Some(mut sample) = lent {
        let bytes = Bytes::writable(sample.memory_mut());
        (LoanMemory::Lent(Lent::new(sample)), bytes)
    } else {
        let mut own = Aligned::zeros(size);
        let bytes = Bytes::writable(own.bytes_mut());
        (LoanMemory::Own(own), bytes)
    };
    let number = handles::hold(Held::Loan(Loan {
        slot,
        operation,
        request,
        memory,
    }));
    Ok((held(number), bytes))
}

/// Publishes a sample that the program has written.
pub(crate) fn send(loan: u64) -> Result<Answer, Answer> {
    let gone = || Answer::new(NOT_SENT, 0, "the loan was sent or dropped before");
    let Loan {
        slot,
        operation,
        request,
        memory,
    } = handles::take_loan(loan)?.ok_or_else(gone)?;
    let invalid = |error: ValueError| Answer::new(INVALID_SAMPLE, 0, error.to_string());
    match memory {
        LoanMemory::Lent(mut lent) => {
            let mut sample = lent.take().ok_or(HostError::WrongThread)?;
            // The program may have written any bytes.
            check_image(&request, sample.memory_mut()).map_err(invalid)?;
            let encode = |image: &[u8]| {
                let body = decode_image(&request, image).and_then(|value| encode_body(&value));
                body.map_err(|error| EncodeError::NoValue(error.to_string()))
            };
            session::with(|session| {
                let publisher = session.publisher(slot, operation)?;
                Ok(publisher.send_image(sample, &encode))
            })??;
        }
        LoanMemory::Own(mut image) => {
            let value = decode_image(&request, image.bytes_mut());
            link::publish(slot, operation, &value.map_err(invalid)?)??;
        }
    }
    Ok(Answer::number(0))
}

/// Publishes a sample.
pub(crate) fn publish(slot: usize, operation: usize, body: &[u8]) -> Result<Answer, Answer> {
    bodies::publish(slot, operation, body)??;
    Ok(Answer::number(0))
}

/// An age as the number of an answer: nanoseconds times 8, twice the number of the label, and whether
/// it is fresh.
pub(crate) fn age(of: Freshness) -> i64 {
    let label = match of.made {
        Made::Computed => 0,
        Made::PartlyCached => 1,
        Made::Cached => 2,
    };
    let age = nanoseconds(of.age).min(i64::MAX >> 3);
    age << 3 | label << 1 | i64::from(of.is_fresh)
}

/// The newest sample of a topic.
pub(crate) fn newest(slot: usize, operation: usize) -> Result<Answer, Answer> {
    let program = program()?;
    let described = link::operation(&program, slot, operation)?;
    let newest = bodies::newest(slot, operation, described)??;
    Ok(Answer::new(DONE, age(newest.freshness), newest.value))
}

/// Sets the result that answers a query.
pub(crate) fn set_latest(slot: usize, operation: usize, body: &[u8]) -> Result<Answer, Answer> {
    let program = program()?;
    let described = link::operation(&program, slot, operation)?;
    let reply = decode(&described.reply, Encoding::Cdr, body).map_err(|error| {
        Answer::new(INVALID_SAMPLE, 0, format!("{}(): {error}", described.name))
    })?;
    link::set_latest(slot, operation, reply)??;
    Ok(Answer::number(0))
}

fn nanoseconds(time: Duration) -> i64 {
    i64::try_from(time.as_nanos()).unwrap_or(i64::MAX)
}

/// A duration of the headers.
///
/// # Errors
/// It is negative.
fn duration(nanoseconds: i64) -> Result<Duration, Answer> {
    let nanoseconds = u64::try_from(nanoseconds);
    nanoseconds.map(Duration::from_nanos).map_err(|_| {
        Answer::new(
            INVALID_ARGUMENT,
            0,
            "a duration is 0 or longer; this one is negative",
        )
    })
}

/// Reads something of the component.
pub(crate) fn get(what: Get, number: usize) -> Result<Answer, Answer> {
    Ok(match what {
        Get::Name => Answer::text(&session::with_core(|core| core.name().to_owned())?),
        Get::Network => Answer::text(&session::with_core(|core| core.network().to_owned())?),
        Get::State => Answer::text(session::with_core(|core| core.state().word())?),
        Get::Now => Answer::number(session::with_core(|core| core.now().as_nanos())?.cast_signed()),
        Get::Period => Answer::number(session::with_core(|core| nanoseconds(core.period()))?),
        Get::IsStopping => Answer::number(session::with_core(|core| core.is_stopping())?.into()),
        Get::Seed => {
            Answer::number(session::with_core(|core| core.random().u64(..))?.cast_signed())
        }
        Get::Peers => {
            let peers = session::with(|session| Ok(session.peers(number)))?;
            Answer::number(i64::try_from(peers).unwrap_or(i64::MAX))
        }
        Get::Timeout => {
            let timeout = session::with(|session| Ok(session.client(number)?.timeout()))?;
            Answer::number(nanoseconds(timeout))
        }
        Get::Freshness => Answer::number(link::freshness(number)?.map_or(-1, age)),
        Get::IsIn => {
            let state = of_machine(number, |program| {
                program
                    .machine
                    .map_or(0, |machine| machine.chart.states.len())
            })?;
            Answer::number(session::with_machine(|machine| machine.is_in(state))?.into())
        }
        Get::HasEnded => {
            Answer::number(session::with_machine(|machine| machine.has_ended())?.into())
        }
        Get::Listed => match session::with(|session| session.listed(number))? {
            None => Answer::number(-1),
            Some(all) => names(&all),
        },
        Get::TimeIsActive => Answer::number(session::with_time(|time| time.is_active())?.into()),
        Get::TimeTick => Answer::number(session::with_time(|time| time.tick())?.cast_signed()),
        Get::TimeMissing => names(&session::with_time(|time| time.missing())?),
        Get::TimeFollowers => names(&session::with_time(|time| time.followers())?),
    })
}

fn names(all: &[String]) -> Answer {
    let mut writer = Writer::default();
    writer.length(all.len());
    all.iter().for_each(|name| writer.put(name));
    Answer::new(DONE, 0, writer.into_bytes())
}

/// Changes something of the component.
pub(crate) fn set(what: Set, number: usize, value: i64, text: &str) -> Result<Answer, Answer> {
    match what {
        Set::Period => {
            let period = duration(value)?;
            session::with_core(|core| core.set_period(period))?;
        }
        Set::Timeout => {
            let timeout = duration(value)?;
            session::with(|session| {
                session.client(number)?.set_timeout(timeout);
                Ok(())
            })?;
        }
        Set::Parameter => {
            let (path, written) = text.split_once('\n').unwrap_or((text, ""));
            let value = parameter(number, value, written).map_err(|error| Answer {
                bytes: format!("`{path}`: {}", error.reason()).into_bytes(),
                ..error
            })?;
            session::with_core(|core| core.set_parameter(path, value))?;
        }
        Set::Stop => session::with_core(|core| core.stop(text))?,
        Set::Fire => {
            let event = of_machine(number, |program| {
                program
                    .machine
                    .map_or(0, |machine| machine.chart.fireable.into())
            })?;
            session::with_machine(|machine| machine.fire(event))?;
        }
        Set::Open => {
            let member = session::with(|session| session.open_member(number, text))?;
            return Ok(Answer::number(
                i64::try_from(member.slot()).unwrap_or(i64::MAX),
            ));
        }
        Set::TimeAdvance => {
            let by = duration(value)?;
            let tick = session::with_time(|time| time.advance(by))??;
            return Ok(Answer::number(tick.cast_signed()));
        }
        Set::TimeTo => {
            let to = duration(value)?.as_nanos();
            let to = Time::from_nanos(u64::try_from(to).unwrap_or(u64::MAX));
            let tick = session::with_time(|time| time.set(to))??;
            return Ok(Answer::number(tick.cast_signed()));
        }
        Set::TimeWait if value < 0 => session::with_time(TimeSource::wait_for_nobody)?,
        Set::TimeWait => {
            let limit = duration(value)?;
            session::with_time(|time| time.wait_for_all(limit))?;
        }
        Set::TimeOrder => {
            let order = if value == 0 {
                Order::AtOnce
            } else {
                Order::InTurn
            };
            session::with_time(|time| time.set_order(order))?;
        }
        Set::TimePace => session::with_time(|time| time.set_paced(value != 0))?,
        Set::TimeRelease => {
            return Ok(Answer::number(
                session::with_time(|time| time.release(text))?.into(),
            ));
        }
    }
    Ok(Answer::number(0))
}

/// A value of a parameter, `enum rc_value_kind` of `abi.h`.
fn parameter(kind: usize, value: i64, text: &str) -> Result<rc_runtime::Value, Answer> {
    use rc_runtime::Value;
    Ok(match kind {
        0 => Value::Bool(value != 0),
        1 => Value::Int(value),
        2 => Value::Float(f64::from_bits(value.cast_unsigned())),
        3 => Value::Text(text.to_owned()),
        4 => Value::from(duration(value)?),
        _ => return Err(internal("a parameter has no such value")),
    })
}

/// A number of a state or of an event that the machine has.
fn of_machine(number: usize, count: impl FnOnce(&Program) -> usize) -> Result<Number, Answer> {
    let program = program()?;
    match u16::try_from(number) {
        Ok(known) if number < count(&program) => Ok(Number(known)),
        _ => Err(internal(format!(
            "the state machine has no number {number}"
        ))),
    }
}

/// `enum rc_get_what` of `abi.h`.
#[derive(Clone, Copy)]
pub(crate) enum Get {
    Name,
    Network,
    State,
    Now,
    Period,
    IsStopping,
    Seed,
    Peers,
    Timeout,
    IsIn,
    HasEnded,
    Freshness,
    /// The members of a slot array that the network lists, or the number -1.
    Listed,
    /// Of the source of the network's time.
    TimeIsActive,
    TimeTick,
    TimeMissing,
    TimeFollowers,
}

impl Get {
    pub(crate) const ALL: [Self; 17] = [
        Self::Name,
        Self::Network,
        Self::State,
        Self::Now,
        Self::Period,
        Self::IsStopping,
        Self::Seed,
        Self::Peers,
        Self::Timeout,
        Self::IsIn,
        Self::HasEnded,
        Self::Freshness,
        Self::Listed,
        Self::TimeIsActive,
        Self::TimeTick,
        Self::TimeMissing,
        Self::TimeFollowers,
    ];
}

/// `enum rc_set_what` of `abi.h`.
#[derive(Clone, Copy)]
pub(crate) enum Set {
    Period,
    Timeout,
    Stop,
    Fire,
    /// Opens a member of a slot array. The answer has the number of its slot.
    Open,
    /// Of the source of the network's time. The answers of the first two have the number of the tick.
    TimeAdvance,
    TimeTo,
    /// For all followers, so many nanoseconds; for nobody, if it is negative.
    TimeWait,
    TimeOrder,
    TimePace,
    /// Waits no more for a follower.
    TimeRelease,
    /// Requests a change of a parameter of the component: its path and, in the next lines, a text.
    Parameter,
}

impl Set {
    pub(crate) const ALL: [Self; 12] = [
        Self::Period,
        Self::Timeout,
        Self::Stop,
        Self::Fire,
        Self::Open,
        Self::TimeAdvance,
        Self::TimeTo,
        Self::TimeWait,
        Self::TimeOrder,
        Self::TimePace,
        Self::TimeRelease,
        Self::Parameter,
    ];
}
