//! How requests and replies are told apart, in both mappings of services.

use crate::config::Mapping;
use crate::wire::{CYCLONE_HEADER, Sample};
use rc_network::Guid;

/// What stands before a body, and what beside it.
pub(crate) struct Mark {
    /// Before the body.
    pub(crate) header: Vec<u8>,
    /// Beside it, for the library.
    pub(crate) related: Option<(Guid, i64)>,
}

/// A request, as its client names it: the client, and the number of the request. A negative number in a reply says that
/// nothing was executed, and why stands in its body; only ends of ours send and are sent that.
pub(crate) type Id = (Guid, i64);

/// From this length on, with its mark, a reply may be sent in fragments.
const LARGE: usize = 1024;

/// Whether the Enhanced mapping cannot carry a reply: `rustdds` writes fragments with something beside them in a form that
/// nobody can read (0.15.1, `DataFrag::write_to`).
pub(crate) fn is_too_large(mapping: Mapping, length: usize) -> bool {
    mapping == Mapping::Enhanced && length > LARGE
}

/// The mark of a request, or of a reply to it.
///
/// Enhanced (as `rmw_fastrtps`): a request has the number of its sample, a reply that of its request beside it. Cyclone (as
/// `rmw_cyclonedds`): both have a header of the second half of the client's identity and the number.
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

/// What a sample is or answers, and how many bytes of it are not its body; why that cannot be told.
pub(crate) fn read(
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
                // A large reply of one of ours to one of ours.
                (None, Some(client)) => in_header(sample.taken.body()?, client),
                // Fast DDS names the reader that waits for the answer, and leaves the number open.
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
