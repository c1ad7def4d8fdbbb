//! Ports whose messages are converted, because the other end has other units (`--convert`). The
//! middleware and other subscribers see the values of the sender. Taps and exact recordings of this
//! component see converted values.

mod counts;
mod frames;

pub(crate) use counts::ConversionCounts;
pub use frames::Places;
pub(crate) use frames::{
    Fed, Frames, IdleFlag, OwnPlaces, Shared, Source, Tf, TfSlot, Tree, history,
};

use counts::ValueSource;
use frames::NoTransform;
use rc_conversion::{Fault, Place, Plan, Program, RunResult};
use rc_diagnostics::foreign::clean;
use rc_middleware::in_place::zerocopy::IntoBytes;
use rc_middleware::request_body::{RequestBody, buffer};
use rc_middleware::started::Awaiting;
use rc_middleware::typed::{self, Operation};
use rc_middleware::{
    CallError, Client, DecodeError, EncodeError, Encoding, Header, KeptSample, OpenError, Profile,
    QueueGauge, ReceiveError, Subscriber, Unread, rpc,
};
use std::collections::BTreeMap;
use std::fmt;
use std::os::fd::BorrowedFd;
use std::time::Duration;

/// The conversions of slots.
#[derive(Clone, Debug, Default)]
pub(crate) struct Conversions {
    /// The plan of each slot, by name, as its text: only what converts knows plans.
    pub(crate) plans: BTreeMap<String, String>,
    /// The slots that know where frames are, with commas, for slots whose plans need them.
    pub(crate) trees: BTreeMap<String, String>,
    /// The providers of slots, as people name them: `lidar.Cloud`.
    pub(crate) providers: BTreeMap<String, String>,
}

/// Why a message is not converted.
#[derive(Debug)]
enum Refused {
    Fault(Fault),
    /// The transform between these frames at this time is not known.
    Frames {
        from: String,
        to: String,
        nanoseconds: i64,
        reason: NoTransform,
    },
}

impl From<Fault> for Refused {
    fn from(fault: Fault) -> Self {
        Self::Fault(fault)
    }
}

impl fmt::Display for Refused {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Fault(fault) => fault.fmt(f),
            Self::Frames {
                from,
                to,
                nanoseconds,
                reason,
            } => write!(
                f,
                "no transform from `{}` to `{to}` at {nanoseconds} ns: {reason}",
                clean(from)
            ),
        }
    }
}

/// A copy of a message. It is aligned as a memory image has to be.
#[derive(Default)]
struct Copied {
    words: Vec<u128>,
    length: usize,
}

impl Copied {
    fn fill(&mut self, body: &[u8]) -> &mut [u8] {
        let words = body.len().div_ceil(size_of::<u128>());
        if self.words.len() < words {
            self.words.resize(words, 0);
        }
        self.length = body.len();
        let bytes = &mut self.words.as_mut_bytes()[..body.len()];
        bytes.copy_from_slice(body);
        bytes
    }

    fn bytes(&self) -> &[u8] {
        &self.words.as_bytes()[..self.length]
    }
}

/// A sample that its handler may keep.
impl KeptSample for Copied {
    fn memory(&self) -> &[u8] {
        self.bytes()
    }
}

/// A subscriber of a topic in other units.
pub(crate) struct ConvertingSubscriber {
    port: Box<dyn Subscriber>,
    programs: SampleProgram,
    address: String,
    copy: Copied,
    /// A refused sample is an error, and not lost as well.
    unread: Unread,
}

struct SampleProgram {
    type_hash: u64,
    cdr: Option<Program>,
    image: Option<Program>,
    /// Knows where frames are, if a program needs it.
    frames: Option<Frames>,
    counts: ConversionCounts,
}

/// The result for a sample.
enum Outcome {
    /// It stays as it is.
    Unchanged,
    /// The copy is the converted one.
    Converted,
    /// It is not handled, because the component is not active.
    Dropped,
}

impl SampleProgram {
    /// Converts a copy of a sample. A sample of another type stays as it is, and is refused later.
    /// While the component is not active, no tree is asked.
    fn run(&mut self, header: Header, body: &[u8], copy: &mut Copied) -> Result<Outcome, String> {
        let is_strange = header.type_hash != 0 && header.type_hash != self.type_hash;
        let program = match header.encoding {
            Encoding::Cdr => &self.cdr,
            Encoding::Image => &self.image,
        };
        let Some(program) = program.as_ref().filter(|_| !is_strange) else {
            return Ok(Outcome::Unchanged);
        };
        let is_idle = self.frames.as_ref().is_some_and(Frames::is_idle);
        if is_idle && program.takes_transforms() {
            return Ok(Outcome::Dropped);
        }
        let result = convert(program, self.frames.as_mut(), copy.fill(body));
        self.counts.note(ValueSource::Provider, result)?;
        Ok(Outcome::Converted)
    }
}

/// Converts a sample, with the transforms that it needs.
fn convert(
    program: &Program,
    frames: Option<&mut Frames>,
    bytes: &mut [u8],
) -> Result<RunResult, Refused> {
    let Some(frames) = frames.filter(|_| program.takes_transforms()) else {
        return Ok(program.run_with(bytes, 0, &[])?);
    };
    let needed = program.needed(bytes, 0)?;
    let transforms = frames.transforms(&needed).map_err(|(at, reason)| {
        let needed = &needed[at];
        Refused::Frames {
            from: needed.from.clone(),
            to: needed.to.to_owned(),
            nanoseconds: needed.time,
            reason,
        }
    })?;
    Ok(program.run_with(bytes, 0, &transforms)?)
}

impl ConvertingSubscriber {
    /// A subscriber of an operation, which converts its samples if the plan does. `frames` opens
    /// what knows where frames are, if a program needs it.
    pub(crate) fn over(
        (plan, operation, of): (&Plan, usize, &Operation),
        address: String,
        counts: &ConversionCounts,
        frames: impl FnOnce() -> Result<Frames, OpenError>,
        port: Box<dyn Subscriber>,
    ) -> Result<Box<dyn Subscriber>, OpenError> {
        let mut programs = SampleProgram {
            type_hash: of.type_hash,
            cdr: plan.program(operation, Place::Input),
            image: plan.program(operation, Place::InputImage),
            frames: None,
            counts: counts.clone(),
        };
        if programs.cdr.is_none() && programs.image.is_none() {
            return Ok(port);
        }
        let mut own = programs.cdr.iter().chain(&programs.image);
        if own.any(Program::takes_transforms) {
            programs.frames = Some(frames()?);
        }
        Ok(Box::new(Self {
            port,
            programs,
            address,
            copy: Copied::default(),
            unread: Unread::default(),
        }))
    }

    fn outcome(
        address: &str,
        received: Result<bool, ReceiveError>,
        fault: Option<String>,
    ) -> Result<bool, ReceiveError> {
        match fault {
            None => received,
            Some(reason) => Err(ReceiveError {
                address: address.to_owned(),
                reason,
            }),
        }
    }
}

impl Subscriber for ConvertingSubscriber {
    fn descriptor(&self) -> BorrowedFd<'_> {
        self.port.descriptor()
    }

    fn acknowledge(&mut self, woken: bool) {
        self.port.acknowledge(woken);
    }

    fn receive(&mut self, take: &mut dyn FnMut(Header, &[u8])) -> Result<bool, ReceiveError> {
        let Self {
            port,
            programs,
            address,
            copy,
            unread,
        } = self;
        let mut fault = None;
        let received = port.receive(
            &mut |mut header, body| match programs.run(header, body, copy) {
                Ok(Outcome::Dropped) => unread.note(header.sender),
                Ok(became) => {
                    unread.renumber(&mut header);
                    let is_converted = matches!(became, Outcome::Converted);
                    take(header, if is_converted { copy.bytes() } else { body });
                }
                Err(error) => {
                    unread.note(header.sender);
                    fault = Some(error);
                }
            },
        );
        Self::outcome(address, received, fault)
    }

    fn can_keep(&self) -> bool {
        self.port.can_keep()
    }

    fn receive_kept(
        &mut self,
        take: &mut dyn FnMut(Header, Box<dyn KeptSample>),
    ) -> Result<bool, ReceiveError> {
        let Self {
            port,
            programs,
            address,
            unread,
            ..
        } = self;
        let mut fault = None;
        let received = port.receive_kept(&mut |mut header, sample| {
            let mut copy = Copied::default();
            match programs.run(header, sample.memory(), &mut copy) {
                Ok(Outcome::Dropped) => unread.note(header.sender),
                Ok(became) => {
                    unread.renumber(&mut header);
                    let is_converted = matches!(became, Outcome::Converted);
                    take(header, if is_converted { Box::new(copy) } else { sample });
                }
                Err(error) => {
                    unread.note(header.sender);
                    fault = Some(error);
                }
            }
        });
        Self::outcome(address, received, fault)
    }

    fn peers(&self) -> usize {
        self.port.peers()
    }

    fn queue(&self) -> Option<QueueGauge> {
        self.port.queue()
    }
}

/// A client of a server in other units.
pub(crate) struct ConvertingClient {
    port: Box<dyn Client>,
    calls: Vec<CallPrograms>,
    counts: ConversionCounts,
    copy: Copied,
    /// The operations of started calls that may be converted, by the places of their programs.
    started: BTreeMap<u64, usize>,
}

/// The programs for the calls of an operation.
struct CallPrograms {
    operation: &'static Operation,
    request: Option<Program>,
    result: Option<Program>,
    image: Option<Program>,
    /// The exceptions that are converted, by their hashes.
    exceptions: Vec<(i32, Program)>,
}

impl ConvertingClient {
    /// A client of these operations, some of which the plan converts.
    pub(crate) fn over(
        plan: &Plan,
        operations: &'static [Operation],
        counts: &ConversionCounts,
        port: Box<dyn Client>,
    ) -> Box<dyn Client> {
        let calls = operations.iter().enumerate();
        let calls = calls.map(|(at, operation)| {
            let thrown = operation.replies.iter().filter(|reply| reply.case != 0);
            let thrown = (0..).zip(thrown).filter_map(|(number, reply)| {
                let program = plan.program(at, Place::Exception(number))?;
                Some((reply.case, program))
            });
            CallPrograms {
                operation,
                request: plan.program(at, Place::Input),
                result: plan.program(at, Place::Output),
                image: plan.program(at, Place::OutputImage),
                exceptions: thrown.collect(),
            }
        });
        Box::new(Self {
            port,
            calls: calls.collect(),
            counts: counts.clone(),
            copy: Copied::default(),
            started: BTreeMap::new(),
        })
    }
}

impl CallPrograms {
    /// The program for a reply.
    fn reply(&self, case: i32, encoding: Encoding) -> Option<&Program> {
        match (case, encoding) {
            (0, Encoding::Cdr) => self.result.as_ref(),
            (0, Encoding::Image) => self.image.as_ref(),
            _ => {
                let mut thrown = self.exceptions.iter();
                thrown
                    .find(|(own, _)| *own == case)
                    .map(|(_, program)| program)
            }
        }
    }

    /// Converts a copy of a reply. A reply without values stays as it is.
    fn convert_reply(
        &self,
        (header, profile): (Header, Profile),
        body: &[u8],
        counts: &ConversionCounts,
        copy: &mut Copied,
    ) -> Result<bool, CallError> {
        let Some((case, at)) = typed::reply_values(self.operation, profile, header, body)? else {
            return Ok(false);
        };
        let Some(program) = self.reply(case, header.encoding) else {
            return Ok(false);
        };
        let result = program
            .run_with(copy.fill(body), at, &[])
            .map_err(Refused::from);
        match counts.note(ValueSource::Provider, result) {
            Ok(()) => Ok(true),
            Err(reason) => Err(DecodeError::Invalid(EncodeError::NoValue(reason)).into()),
        }
    }
}

/// The programs for a request, and where its parameters begin. `None` for an unknown operation.
fn of_request<'c>(
    calls: &'c [CallPrograms],
    profile: Profile,
    request: &dyn RequestBody,
) -> Option<(&'c CallPrograms, usize)> {
    let (id, at) = rpc::request_values(request.begin(), profile).ok()?;
    let mut calls = calls.iter();
    calls
        .find(|call| call.operation.id == id)
        .map(|call| (call, at))
}

/// The converted request. `None` if it stays as it is.
fn converted_request(
    (call, at): (&CallPrograms, usize),
    request: &dyn RequestBody,
    counts: &ConversionCounts,
) -> Result<Option<Vec<u8>>, CallError> {
    let Some(program) = &call.request else {
        return Ok(None);
    };
    let mut bytes = buffer(request)?;
    let result = program.run_with(&mut bytes, at, &[]).map_err(Refused::from);
    match counts.note(ValueSource::Own, result) {
        Ok(()) => Ok(Some(bytes)),
        Err(reason) => Err(EncodeError::NoValue(reason).into()),
    }
}

impl Client for ConvertingClient {
    fn guid(&self) -> [u8; 16] {
        self.port.guid()
    }

    fn profile(&self) -> Profile {
        self.port.profile()
    }

    fn send(&mut self, header: Header, request: &dyn RequestBody) -> Result<(), CallError> {
        if let Some(found) = of_request(&self.calls, self.port.profile(), request)
            && let Some(bytes) = converted_request(found, request, &self.counts)?
        {
            return self.port.send(header, &bytes);
        }
        self.port.send(header, request)
    }

    fn can_loan(&self) -> bool {
        self.port.can_loan()
    }

    fn call(
        &mut self,
        header: Header,
        request: &dyn RequestBody,
        limit: Duration,
        take: &mut dyn FnMut(Header, &[u8]),
    ) -> Result<(), CallError> {
        let Self {
            port,
            calls,
            counts,
            copy,
            ..
        } = self;
        let profile = port.profile();
        let Some((call, at)) = of_request(calls, profile, request) else {
            return port.call(header, request, limit, take);
        };
        let bytes = converted_request((call, at), request, counts)?;
        let request: &dyn RequestBody = match &bytes {
            Some(bytes) => bytes,
            None => request,
        };
        let mut failure = None;
        port.call(
            header,
            request,
            limit,
            &mut |header, body| match call.convert_reply((header, profile), body, counts, copy) {
                Ok(true) => take(header, copy.bytes()),
                Ok(false) => take(header, body),
                Err(error) => failure = Some(error),
            },
        )?;
        failure.map_or(Ok(()), Err)
    }

    fn start(
        &mut self,
        header: Header,
        request: &dyn RequestBody,
        limit: Duration,
    ) -> Result<(), CallError> {
        let found = of_request(&self.calls, self.port.profile(), request);
        let Some((call, at)) = found else {
            return self.port.start(header, request, limit);
        };
        let place = self
            .calls
            .iter()
            .position(|other| std::ptr::eq(other, call));
        match converted_request((call, at), request, &self.counts)? {
            Some(bytes) => self.port.start(header, &bytes, limit)?,
            None => self.port.start(header, request, limit)?,
        }
        self.started
            .extend(place.map(|place| (header.sequence, place)));
        Ok(())
    }

    fn poll(
        &mut self,
        take: &mut dyn FnMut(u64, Header, &[u8]),
    ) -> Option<(u64, Result<(), CallError>)> {
        let Self {
            port,
            calls,
            counts,
            copy,
            started,
        } = self;
        let profile = port.profile();
        let mut failure = None;
        let (sequence, result) = port.poll(&mut |sequence, header, body| {
            let call = started.get(&sequence).and_then(|place| calls.get(*place));
            let converted = call.map_or(Ok(false), |call| {
                call.convert_reply((header, profile), body, counts, copy)
            });
            match converted {
                Ok(true) => take(sequence, header, copy.bytes()),
                Ok(false) => take(sequence, header, body),
                Err(error) => failure = Some(error),
            }
        })?;
        started.remove(&sequence);
        Some((sequence, failure.map_or(result, Err)))
    }

    fn end_in_order(&mut self, keeps: bool) {
        self.port.end_in_order(keeps);
    }

    fn forget(&mut self, sequence: u64) {
        self.started.remove(&sequence);
        self.port.forget(sequence);
    }

    fn awaiting(&self) -> Option<Awaiting<'_>> {
        self.port.awaiting()
    }

    fn replies_have_ages(&self) -> bool {
        self.port.replies_have_ages()
    }

    fn senders(&self) -> Vec<u128> {
        self.port.senders()
    }

    fn number_there(&self, request: &dyn RequestBody) -> Option<u64> {
        self.port.number_there(request)
    }

    fn peers(&self) -> usize {
        self.port.peers()
    }

    fn server(&self) -> u128 {
        self.port.server()
    }

    fn queue(&self) -> Option<QueueGauge> {
        self.port.queue()
    }
}

#[cfg(test)]
mod tests;
