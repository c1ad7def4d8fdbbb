//! The data that a supervisor passes to a process of several components: at standard input, one
//! byte with two descriptors for each of them, its link and its log.

use rustix::io::Errno;
use rustix::net::{
    RecvAncillaryBuffer, RecvAncillaryMessage, RecvFlags, ReturnFlags, SendAncillaryMessage,
    recvmsg,
};
use std::fs::File;
use std::io::{self, IoSliceMut, Read};
use std::mem::MaybeUninit;
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::os::unix::net::UnixStream;

/// The most components of a process that has a supervisor. The kernel passes 253 descriptors at
/// once.
pub(super) const MOST: usize = 100;

/// The data for one component.
#[derive(Debug)]
pub(super) struct Handed {
    pub(super) link: UnixStream,
    pub(super) log: File,
}

/// The link of the process. It signals only its end.
pub(super) struct ProcessLink(UnixStream);

impl ProcessLink {
    /// Takes the descriptors of this many components from standard input. They are there before the
    /// process starts.
    pub(super) fn inherited(count: usize) -> io::Result<(Self, Vec<Handed>)> {
        let stream = UnixStream::from(io::stdin().as_fd().try_clone_to_owned()?);
        let handed = receive(&stream, count)?;
        stream.set_nonblocking(true)?;
        Ok((Self(stream), handed))
    }

    /// Whether the supervisor has closed it. Other data are ignored.
    pub(super) fn is_closed(&self) -> bool {
        let mut bytes = [0_u8; 256];
        match (&self.0).read(&mut bytes) {
            Ok(count) => count == 0,
            Err(error) => !matches!(
                error.kind(),
                io::ErrorKind::WouldBlock | io::ErrorKind::Interrupted
            ),
        }
    }
}

impl AsFd for ProcessLink {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.0.as_fd()
    }
}

fn receive(stream: &UnixStream, count: usize) -> io::Result<Vec<Handed>> {
    let wrong = |what: String| {
        let what = format!(
            "the supervisor hands over {what}, not a link and a log for each of {count} components"
        );
        io::Error::new(io::ErrorKind::InvalidData, what)
    };
    if count > MOST {
        return Err(wrong(format!("descriptors for {MOST} components at most")));
    }
    // Room for more than is wanted, so that a supervisor that hands over more is noticed.
    let borrowed: Vec<BorrowedFd<'_>> = vec![stream.as_fd(); 2 * count + 1];
    let room = SendAncillaryMessage::ScmRights(&borrowed).size();
    let mut space = vec![MaybeUninit::uninit(); room];
    let mut control = RecvAncillaryBuffer::new(&mut space);
    let mut byte = [0_u8];
    let flags = RecvFlags::CMSG_CLOEXEC | RecvFlags::DONTWAIT;
    let received = match recvmsg(
        stream,
        &mut [IoSliceMut::new(&mut byte)],
        &mut control,
        flags,
    ) {
        Err(Errno::AGAIN) => return Err(wrong("nothing".to_owned())),
        received => received?,
    };
    let mut descriptors: Vec<OwnedFd> = Vec::new();
    for message in control.drain() {
        if let RecvAncillaryMessage::ScmRights(all) = message {
            descriptors.extend(all);
        }
    }
    if received.bytes == 0
        || received.flags.contains(ReturnFlags::CTRUNC)
        || descriptors.len() != 2 * count
    {
        return Err(wrong(format!("{} descriptors", descriptors.len())));
    }
    let mut descriptors = descriptors.into_iter();
    let mut handed = Vec::with_capacity(count);
    while let (Some(link), Some(log)) = (descriptors.next(), descriptors.next()) {
        handed.push(Handed {
            link: link.into(),
            log: log.into(),
        });
    }
    Ok(handed)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rustix::net::{SendAncillaryBuffer, SendFlags, sendmsg};
    use std::io::{IoSlice, Write};

    /// A supervisor that hands over so many pairs of a link and a log.
    fn handed(pairs: usize) -> (UnixStream, Vec<UnixStream>) {
        let (ours, theirs) = UnixStream::pair().expect("a pair");
        let links: Vec<_> = (0..2 * pairs)
            .map(|_| UnixStream::pair().expect("a pair"))
            .collect();
        let borrowed: Vec<_> = links.iter().map(|(_, theirs)| theirs.as_fd()).collect();
        let message = SendAncillaryMessage::ScmRights(&borrowed);
        let mut space = vec![MaybeUninit::uninit(); message.size()];
        let mut control = SendAncillaryBuffer::new(&mut space);
        assert!(borrowed.is_empty() || control.push(message));
        let sent = sendmsg(
            &ours,
            &[IoSlice::new(b"\n")],
            &mut control,
            SendFlags::empty(),
        );
        assert_eq!(sent, Ok(1));
        // Its end closes the link.
        std::mem::forget(ours);
        (theirs, links.into_iter().map(|(ours, _)| ours).collect())
    }

    #[test]
    fn every_component_gets_its_link_and_its_log() {
        let (stream, ours) = handed(3);
        let got = receive(&stream, 3).expect("three pairs");
        assert_eq!(got.len(), 3);
        for (handed, ours) in got.iter().zip(ours.chunks(2)) {
            let mut byte = [0];
            (&ours[0]).write_all(b"l").expect("room");
            (&handed.link).read_exact(&mut byte).expect("a byte");
            assert_eq!(&byte, b"l");
            (&handed.log).write_all(b"m").expect("room");
            (&ours[1]).read_exact(&mut byte).expect("a byte");
            assert_eq!(&byte, b"m");
        }
    }

    #[test]
    fn a_wrong_number_of_descriptors_is_refused() {
        for (pairs, wanted) in [(1, 2), (3, 2), (0, 1)] {
            let (stream, _ours) = handed(pairs);
            let error = receive(&stream, wanted).expect_err("a refusal").to_string();
            assert!(
                error.contains(&format!("each of {wanted} components")),
                "{error}"
            );
        }
        let (_ours, stream) = UnixStream::pair().expect("a pair");
        let error = receive(&stream, 1).expect_err("nothing is there");
        assert!(error.to_string().contains("hands over nothing"), "{error}");
        let (stream, _ours) = handed(1);
        assert!(receive(&stream, MOST + 1).is_err());
    }
}
