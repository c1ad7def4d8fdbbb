//! The worker: hands each message on.

use crate::description::Description;
use rc_host::{Operation, Program, read, write};
use rc_middleware::cdr::Cdr;
use rc_middleware::rpc::ENVELOPE_OF_VALUES;
use rc_middleware::typed::{HandlerError, Request, TypedClient, TypedPublisher};
use rc_middleware::{CallError, EncodeError, Encoding, Reader, SendError, Writer};
use rc_runtime::{
    Component, Core, ForwardCounts, Member, Ports, Role, Sample, StartError, WorkerError,
};
use rc_values::Struct;
use std::cell::Cell;
use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Instant;

/// What sends in a slot, or in a member of an array.
enum Sender {
    Client(TypedClient),
    /// By the number of the operation.
    Publishers(Vec<TypedPublisher>),
}

impl Sender {
    fn open(
        program: &Program,
        described: usize,
        ports: &rc_runtime::Connections,
        slot: usize,
    ) -> Result<Self, rc_middleware::OpenError> {
        let of = &program.slots[described];
        if of.role == Role::Requires {
            return ports.client(slot).map(Self::Client);
        }
        let topics = (0..of.operations.len()).map(|operation| ports.publisher(slot, operation));
        Ok(Self::Publishers(topics.collect::<Result<_, _>>()?))
    }

    fn peers(&self) -> usize {
        match self {
            Self::Client(client) => client.peers(),
            Self::Publishers(topics) => topics.iter().map(TypedPublisher::peers).max().unwrap_or(0),
        }
    }
}

/// A slot of the description, and the name of the member of an array; `""` for a slot that is none.
type Place = (usize, String);

/// The component of a [`Description`] while it runs.
pub struct Forwarder<'d> {
    core: Core,
    description: &'d Description,
    /// What sends, each with the number of its slot.
    senders: BTreeMap<Place, (usize, Sender)>,
    /// What was received and handed on.
    counts: BTreeMap<Place, ForwardCounts>,
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

    /// What sends for a slot that receives, and the counts of the latter.
    fn next(
        &mut self,
        slot: usize,
        member: Option<&Member>,
    ) -> Option<(&mut Sender, &ForwardCounts)> {
        let next = self.description.routes.get(slot).copied().flatten()?;
        let name = member.map_or("", |member| member.name());
        let (_, sender) = self.senders.get_mut(&(next, name.to_owned()))?;
        let counts = self.counts.get(&(slot, name.to_owned()))?;
        Some((sender, counts))
    }
}

/// The message has no route: the network connects slots that the description does not have.
fn no_route() -> HandlerError {
    HandlerError("nothing follows this slot".to_owned())
}

/// Whether the bytes that a reader is at may be copied to where a writer is.
fn same_place(reader: &Reader<'_>, writer: &Writer<'_>) -> bool {
    reader.position() % 8 == writer.len() % 8
}

/// Writes a structure that follows in a reader: its bytes, if `keeps` says so, else its value.
fn copy(ty: &Arc<Struct>, reader: &Reader<'_>, keeps: bool, writer: &mut Writer<'_>) {
    if keeps {
        // An array of bytes is written straight into the memory of a middleware.
        return u8::encode_all(reader.rest(), writer);
    }
    match read(ty, &mut reader.clone()) {
        Ok(value) => write(&value, writer),
        Err(error) => writer.fail(EncodeError::NoValue(error.to_string())),
    }
}

/// Publishes a received sample.
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
        return topic.send_image(loan, &encode);
    }
    let reader = sample.reader();
    topic.publish_with(|writer| {
        let keeps = image.is_none() && same_place(&reader, writer);
        copy(&operation.request, &reader, keeps, writer);
    })
}

/// Makes a call, and replies with what comes back.
fn call(
    client: &mut TypedClient,
    operation: &Operation,
    arguments: &Reader<'_>,
    request: &mut Request<'_>,
    counts: &ForwardCounts,
) -> Result<Result<(), HandlerError>, CallError> {
    let begin = Instant::now();
    let written = Cell::new(begin);
    client.call_with(
        &operation.wire,
        |writer| {
            pass_arguments(operation, arguments, writer);
            written.set(Instant::now());
        },
        |case, reader| {
            let replied = Instant::now();
            let mut throws = operation.throws.iter();
            let ty = throws.find(|thrown| thrown.id == case);
            let ty = ty.map_or(&operation.reply, |thrown| &thrown.ty);
            let image = reader.clone().image().is_some();
            let reader = &*reader;
            let reply = request.reply_with(case, |writer| {
                // Behind another envelope, or between variants, the bytes would not be the same.
                let keeps = !image
                    && reader.position() == ENVELOPE_OF_VALUES
                    && writer.len() == ENVELOPE_OF_VALUES;
                copy(ty, reader, keeps, writer);
            });
            counts.note((written.get() - begin) + replied.elapsed());
            Ok::<_, CallError>(reply)
        },
    )
}

fn pass_arguments(operation: &Operation, arguments: &Reader<'_>, writer: &mut Writer<'_>) {
    let keeps = same_place(arguments, writer);
    copy(&operation.request, arguments, keeps, writer);
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
        let Some((Sender::Client(client), counts)) = self.next(slot, member) else {
            return request.fail(&no_route());
        };
        if !operation.wire.two_way {
            let begin = Instant::now();
            let sent = client.send_with(&operation.wire, |writer| {
                pass_arguments(operation, &arguments, writer);
            });
            counts.note(begin.elapsed());
            return sent.map_err(|error| failed(operation, &error));
        }
        match call(client, operation, &arguments, request, counts) {
            Ok(replied) => replied,
            Err(CallError::Unavailable { state }) => {
                request.unavailable(&operation.wire, &state);
                Ok(())
            }
            Err(CallError::Refused(reason)) => request.fail(&reason),
            Err(error) => request.fail(&error),
        }
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
