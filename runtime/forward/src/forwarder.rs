//! The worker: hands each message on.

use crate::caller::{Caller, copy, same_place};
use crate::description::Description;
use rc_host::{Operation, Program, read, write};
use rc_middleware::started::Awaiting;
use rc_middleware::typed::{HandlerError, Request, TypedPublisher};
use rc_middleware::{EncodeError, Encoding, Reader, SendError, Writer};
use rc_runtime::{
    CallEnd, Component, Core, ForwardCounts, Member, Ports, Role, Sample, StartError, WorkerError,
};
use std::collections::BTreeMap;
use std::time::{Duration, Instant};

/// How long a proxy waits for the reply to a single call before it handles other messages.
const MOMENT: Duration = Duration::from_micros(200);

/// The sender of a slot, or of a member of an array.
enum Sender<'d> {
    Client(Box<Caller<'d>>),
    /// By the number of the operation.
    Publishers(Vec<TypedPublisher>),
}

impl Sender<'_> {
    fn open(
        program: &Program,
        described: usize,
        ports: &rc_runtime::Connections,
        slot: usize,
    ) -> Result<Self, rc_middleware::OpenError> {
        let of = &program.slots[described];
        if of.role == Role::Requires {
            return ports
                .client(slot)
                .map(|client| Self::Client(Box::new(Caller::new(client))));
        }
        let topics = (0..of.operations.len()).map(|operation| ports.publisher(slot, operation));
        Ok(Self::Publishers(topics.collect::<Result<_, _>>()?))
    }

    fn peers(&self) -> usize {
        match self {
            Self::Client(caller) => caller.client.peers(),
            Self::Publishers(topics) => topics.iter().map(TypedPublisher::peers).max().unwrap_or(0),
        }
    }

    fn under_way(&self) -> usize {
        match self {
            Self::Client(caller) => caller.under_way(),
            Self::Publishers(_) => 0,
        }
    }
}

/// A slot of the description, and the name of the member of an array; `""` for a slot that is none.
type Place = (usize, String);

/// The component of a [`Description`] while it runs.
pub struct Forwarder<'d> {
    core: Core,
    description: &'d Description,
    /// The senders, each with the number of its slot.
    senders: BTreeMap<Place, (usize, Sender<'d>)>,
    /// The counts of forwarded messages.
    counts: BTreeMap<Place, ForwardCounts>,
    /// Whether each call waits for its end, as in simulated time: a reply has to come in the same
    /// tick in each run.
    waits: bool,
    /// The sender of the last call of this turn.
    last: Option<Place>,
}

impl<'d> Forwarder<'d> {
    /// Opens the connections.
    ///
    /// # Errors
    /// A middleware refuses one, or the members of an array differ from those of its route.
    pub fn open(
        description: &'d Description,
        core: Core,
        ports: &Ports,
    ) -> Result<Self, StartError> {
        let mut forwarder = Self {
            core,
            description,
            senders: BTreeMap::new(),
            counts: BTreeMap::new(),
            waits: ports.is_time_simulated(),
            last: None,
        };
        let program = &description.program;
        for (at, slot) in program.slots.iter().enumerate() {
            if slot.is_array {
                for name in ports.listed(at).unwrap_or_default() {
                    forwarder.open_member(ports, at, &name)?;
                }
            } else if matches!(slot.role, Role::Requires | Role::Publishes) {
                let sender = Sender::open(program, at, ports, at)?;
                forwarder.senders.insert((at, String::new()), (at, sender));
            } else {
                let counts = ports.forwards(at);
                forwarder.counts.insert((at, String::new()), counts);
            }
        }
        ports.complete_members()?;
        Ok(forwarder)
    }

    fn open_member(&mut self, ports: &Ports, array: usize, name: &str) -> Result<(), StartError> {
        let program = &self.description.program;
        let sends = matches!(program.slots[array].role, Role::Requires | Role::Publishes);
        let opened = ports.open_member(array, name, |ports, slot| {
            let sender = sends.then(|| Sender::open(program, array, ports, slot));
            Ok((slot, sender.transpose()?))
        });
        let (_, (slot, sender)) = opened.map_err(|error| StartError::System(error.to_string()))?;
        let place = (array, name.to_owned());
        match sender {
            Some(sender) => drop(self.senders.insert(place, (slot, sender))),
            None => drop(self.counts.insert(place, ports.forwards(slot))),
        }
        Ok(())
    }

    /// The sender for a slot that receives, and the counts of that slot.
    fn next(
        &mut self,
        slot: usize,
        member: Option<&Member>,
    ) -> Option<(&mut Sender<'d>, &ForwardCounts)> {
        let next = self.place_after(slot, member)?;
        let (_, sender) = self.senders.get_mut(&next)?;
        let counts = self.counts.get(&(slot, next.1))?;
        Some((sender, counts))
    }

    /// The destination of what a slot receives.
    fn place_after(&self, slot: usize, member: Option<&Member>) -> Option<Place> {
        let next = self.description.routes.get(slot).copied().flatten()?;
        Some(place(next, member))
    }

    /// How many calls have not ended.
    fn under_way(&self) -> usize {
        let senders = self.senders.values();
        senders.map(|(_, sender)| sender.under_way()).sum()
    }

    /// The caller of a slot.
    fn caller(&mut self, slot: usize, member: Option<&Member>) -> Option<&mut Caller<'d>> {
        match self.senders.get_mut(&place(slot, member))? {
            (_, Sender::Client(caller)) => Some(caller),
            _ => None,
        }
    }
}

fn place(slot: usize, member: Option<&Member>) -> Place {
    (slot, member.map_or("", |member| member.name()).to_owned())
}

/// The message has no route: the network connects slots that the description does not have.
fn no_route() -> HandlerError {
    HandlerError("nothing follows this slot".to_owned())
}

/// Publishes a received sample, with the time at which it was sent first.
fn publish(
    topic: &mut TypedPublisher,
    operation: &Operation,
    sample: &Sample<'_>,
) -> Result<(), SendError> {
    let image = sample.reader().image();
    if let Some(image) = image
        && let Some(mut loan) = topic.loan_image(image.len())?
    {
        loan.memory_mut().copy_from_slice(image);
        // For subscribers over a middleware that carries no images.
        let encode = |image: &[u8]| {
            let value = read(&operation.request, &mut Reader::of(image, Encoding::Image));
            let value = value.map_err(|error| EncodeError::NoValue(error.to_string()))?;
            let mut writer = Writer::default();
            write(&value, &mut writer);
            writer.finish()?;
            Ok(writer.into_bytes())
        };
        return topic.forward_image(sample.sent, loan, &encode);
    }
    let reader = sample.reader();
    topic.forward_with(sample.sent, |writer| {
        let keeps = image.is_none() && same_place(&reader, writer);
        copy(&operation.request, &reader, keeps, writer);
    })
}

impl Component for Forwarder<'_> {
    fn core(&mut self) -> &mut Core {
        &mut self.core
    }

    fn compute(&mut self) -> Result<(), WorkerError> {
        Ok(())
    }

    fn sending_peers(&self, peers: &mut [usize]) {
        for (slot, sender) in self.senders.values() {
            if let Some(count) = peers.get_mut(*slot) {
                *count = sender.peers();
            }
        }
    }

    fn serve(
        &mut self,
        slot: usize,
        member: Option<&Member>,
        request: &mut Request<'_>,
    ) -> Result<(), HandlerError> {
        let description = self.description;
        let slots = description.program.slots.get(slot);
        let mut operations = slots.map_or(&[][..], |slot| &slot.operations).iter();
        let found = operations.find(|operation| operation.wire.id == request.operation);
        let Some(operation) = found else {
            return request.unknown();
        };
        let arguments = request.arguments(&operation.wire, |reader| {
            // A value of this process gets its bytes.
            Ok(reader.clone())
        })?;
        let is_later = operation.wire.two_way && !self.waits;
        let later = is_later.then(|| request.defer()).flatten();
        let last = self.place_after(slot, member);
        let Some((Sender::Client(caller), counts)) = self.next(slot, member) else {
            return request.fail(&no_route());
        };
        if !operation.wire.two_way {
            let sent = caller.send(operation, &arguments, counts);
            return sent.map_err(|error| failed(operation, &error));
        }
        // A recording that repeats the life of the component has each call with its reply.
        let Some(later) = later else {
            return caller.call(operation, &arguments, counts, request);
        };
        caller.start(operation, &arguments, counts, later)?;
        self.last = last;
        Ok(())
    }

    fn has_room(&self, slot: usize, member: Option<&Member>) -> bool {
        let next = self.place_after(slot, member);
        match next.and_then(|next| self.senders.get(&next)) {
            Some((_, Sender::Client(caller))) => caller.has_room(),
            _ => true,
        }
    }

    fn has_turns(&self) -> bool {
        true
    }

    /// Waits a moment for a single call, because its reply usually comes at once, and sleeping in
    /// the loop would cost more.
    fn turn(&mut self) -> bool {
        let Some(last) = self.last.take().filter(|_| self.under_way() == 1) else {
            return false;
        };
        match self.senders.get_mut(&last) {
            Some((_, Sender::Client(caller))) => caller.end_within(MOMENT).is_some(),
            _ => false,
        }
    }

    fn starts_calls(&self, _slot: usize) -> bool {
        true
    }

    fn end_call(&mut self, slot: usize, member: Option<&Member>) -> Option<CallEnd> {
        self.caller(slot, member)?.end()
    }

    fn awaiting(&mut self, slot: usize, member: Option<&Member>) -> Option<Awaiting<'_>> {
        self.caller(slot, member)?.awaiting()
    }

    fn receive(
        &mut self,
        slot: usize,
        member: Option<&Member>,
        operation: usize,
        sample: Sample<'_>,
    ) -> Result<(), HandlerError> {
        let described = self.description.program.operation(slot, operation);
        let described = described.ok_or_else(no_route)?;
        if self.description.routes.get(slot) == Some(&None) {
            // The samples are for a conversion.
            return Ok(());
        }
        let begin = Instant::now();
        let Some((Sender::Publishers(topics), counts)) = self.next(slot, member) else {
            return Err(no_route());
        };
        let topic = topics.get_mut(operation).ok_or_else(no_route)?;
        let published = publish(topic, described, &sample);
        counts.note(begin.elapsed());
        published.map_err(|error| failed(described, &error))
    }
}

fn failed(operation: &Operation, error: &dyn std::fmt::Display) -> HandlerError {
    HandlerError(format!("`{}` was not forwarded: {error}", operation.name))
}
