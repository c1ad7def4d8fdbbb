//! The services of an interface, and how both mappings of services match requests and replies.

use crate::config::Mapping;
use crate::endpoint_state::{Group, Inbox};
use crate::names;
use crate::qos;
use crate::session::{EndpointSpec, Port, Session};
use crate::wire::{CYCLONE_HEADER, Sample};
use rc_middleware::{Endpoint, OpenError, WakeEvent};
use rc_network::{EndpointKind, Guid, Role};
use std::rc::Rc;
use std::sync::Arc;

/// One operation of a client or a server.
pub(crate) struct Service {
    /// Its discriminator in the envelope of a call.
    pub(crate) id: i32,
    pub(crate) requests: Port,
    pub(crate) replies: Port,
}

/// Opens the services of an interface, in the order of its operations. Samples go into `inbox` in
/// the order of their arrival.
pub(crate) fn services(
    session: &Rc<Session>,
    endpoint: &Endpoint,
    role: Role,
    signal: &WakeEvent,
    inbox: &Arc<dyn Inbox>,
) -> Result<Vec<Service>, OpenError> {
    let address = endpoint.address.to_string();
    let group = Group::default();
    let mut specs = Vec::new();
    for (place, external) in endpoint.external_types.iter().enumerate() {
        let [request, reply] = names::service(endpoint, external, session.rules())?;
        let asks = role == Role::Client;
        // The endpoint of replies comes first: a peer that has found the endpoint of requests soon
        // finds it, too.
        let (own, other) = (EndpointKind::Writer, EndpointKind::Reader);
        let kinds = if asks { [other, own] } else { [own, other] };
        for (topic, kind) in [reply, request].into_iter().zip(kinds) {
            specs.push(EndpointSpec {
                address: &address,
                topic,
                role,
                types: &endpoint.types,
                kind,
                qos: qos::call(),
                signal: signal.clone(),
                is_watched: false,
                inbox: Arc::clone(inbox),
                group: (Arc::clone(&group), place),
            });
        }
    }
    let mut ports = session.ports(specs)?.into_iter();
    let services = endpoint.external_types.iter().map_while(|external| {
        let (replies, requests) = (ports.next()?, ports.next()?);
        Some(Service {
            id: external.id,
            requests,
            replies,
        })
    });
    Ok(services.collect())
}

/// How a sample is marked as a request, or as the reply to one.
pub(crate) struct Mark {
    /// The header before the body.
    pub(crate) header: Vec<u8>,
    /// The related sample identity beside the body.
    pub(crate) related: Option<(Guid, i64)>,
}

/// Identifies a request by its client and its number. A negative number in a reply says that
/// nothing was executed, and the body holds the reason; only components send such replies, and only
/// to components.
pub(crate) type Id = (Guid, i64);

/// From this length on, mark included, a reply may be sent in fragments.
pub(crate) const LARGE: usize = 1024;

/// Whether the Enhanced mapping cannot carry a reply: `rustdds` writes fragments with inline
/// parameters in a form that nobody can read (0.15.1, `DataFrag::write_to`).
pub(crate) fn is_too_large(mapping: Mapping, length: usize) -> bool {
    mapping == Mapping::Enhanced && length > LARGE
}

/// The mark of a request, or of a reply to it.
///
/// Enhanced (as in `rmw_fastrtps`): a request has the number of its sample, and a reply has the
/// identity of its request beside the body. Cyclone (as in `rmw_cyclonedds`): both have a header
/// with the second half of the client's identity and the number.
pub(crate) fn mark(mapping: Mapping, id: Id, is_reply: bool) -> Mark {
    match mapping {
        Mapping::Enhanced => Mark {
            header: Vec::new(),
            related: is_reply.then_some(id),
        },
        Mapping::Cyclone => {
            let mut header = id.0[8..].to_vec();
            header.extend_from_slice(&id.1.to_le_bytes());
            Mark {
                header,
                related: None,
            }
        }
    }
}

/// The identity of a request, or of the request that a reply belongs to, and the number of bytes
/// before the body.
pub(crate) fn read(
    mapping: Mapping,
    sample: &Sample,
    client: Option<&Guid>,
) -> Result<(Id, usize), String> {
    let read = told_apart(mapping, sample, client)?;
    match read {
        // The sign has a meaning, and this number has no counterpart of the other sign.
        ((_, i64::MIN), _) => Err("a sample has a number that no request has".to_owned()),
        read => Ok(read),
    }
}

fn told_apart(
    mapping: Mapping,
    sample: &Sample,
    client: Option<&Guid>,
) -> Result<(Id, usize), String> {
    let body = sample.taken.body()?;
    match mapping {
        Mapping::Enhanced => {
            let own = i64::try_from(sample.sequence).unwrap_or(0);
            match (sample.related, client) {
                (Some(id), Some(_)) => Ok((id, 0)),
                // A large reply of a component to a component.
                (None, Some(client)) => in_header(sample.taken.body()?, client),
                // Fast DDS gives the reader that waits for the reply, and leaves the number open.
                (Some((reader, number)), None) if reader != [0; 16] => {
                    Ok(((reader, if number > 0 { number } else { own }), 0))
                }
                (_, None) => Ok(((sample.writer, own), 0)),
            }
        }
        Mapping::Cyclone => in_header(body, client.unwrap_or(&sample.writer)),
    }
}

/// Reads the header before a body; `client` has the other half of the identity.
fn in_header(body: &[u8], client: &Guid) -> Result<(Id, usize), String> {
    let Some((header, _)) = body.split_first_chunk::<CYCLONE_HEADER>() else {
        return Err("a sample is too short to say what it answers".to_owned());
    };
    let (mut id, mut number) = (*client, [0; 8]);
    id[8..].copy_from_slice(&header[..8]);
    number.copy_from_slice(&header[8..]);
    Ok(((id, i64::from_le_bytes(number)), CYCLONE_HEADER))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::Copying;
    use rustdds::RepresentationIdentifier;
    use rustdds::no_key::Decode;

    fn sample(body: &[u8], related: Option<Id>) -> Sample {
        let Ok(taken) = Copying::default().decode_bytes(body, RepresentationIdentifier::CDR_LE);
        Sample {
            taken,
            writer: [1; 16],
            sequence: 7,
            stamp: 0,
            received: 0,
            related,
            place: 0,
        }
    }

    #[test]
    fn a_number_without_a_counterpart_is_refused() {
        let client = [2; 16];
        for number in [1, -1, i64::MAX, -i64::MAX, i64::MIN] {
            let reply = sample(&[], Some((client, number)));
            let header = mark(Mapping::Cyclone, (client, number), true).header;
            let is_right = number != i64::MIN;
            let read = read(Mapping::Enhanced, &reply, Some(&client));
            assert_eq!(read.is_ok(), is_right, "{number}");
            for whose in [Some(&client), None] {
                let read = super::read(Mapping::Cyclone, &sample(&header, None), whose);
                assert_eq!(read.is_ok(), is_right, "{number}");
            }
        }
        assert!(super::read(Mapping::Cyclone, &sample(&[0; 15], None), None).is_err());
    }
}
