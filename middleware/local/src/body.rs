//! Bodies of messages: memory that its readers share, and that is used again.

use rc_middleware::in_place::{FromZeros, IntoBytes};
use std::sync::Arc;

/// The most bodies that wait for another use.
const MOST: usize = 16;
/// The most bytes of all bodies that wait for another use. A larger one is freed.
const MOST_BYTES: usize = 64 << 20;

/// The content of a message, aligned to 16 bytes for images.
#[derive(Default)]
pub(crate) struct Body {
    words: Vec<u128>,
    length: usize,
}

impl Body {
    /// A body of `length` zero bytes. `None` if there is no memory for it.
    fn new(length: usize) -> Option<Self> {
        let words = u128::new_vec_zeroed(length.div_ceil(size_of::<u128>())).ok()?;
        Some(Self { words, length })
    }

    pub(crate) fn bytes(&self) -> &[u8] {
        &self.words.as_bytes()[..self.length]
    }

    pub(crate) fn bytes_mut(&mut self) -> &mut [u8] {
        &mut self.words.as_mut_bytes()[..self.length]
    }

    /// The memory that it takes, in bytes.
    pub(crate) fn room(&self) -> usize {
        self.words.as_bytes().len()
    }
}

/// The bodies of one sender. A body without readers is used again for the next message.
#[derive(Default)]
pub(crate) struct Pool(Vec<Arc<Body>>);

impl Pool {
    /// A body of `length` bytes with any content, which has no other owner. `None` if there is no
    /// memory for it.
    pub(crate) fn take(&mut self, length: usize) -> Option<Arc<Body>> {
        let fits = |body: &mut Arc<Body>| {
            Arc::get_mut(body).is_some_and(|body| {
                let room = body.room();
                // A small message does not hold the memory of a huge one.
                let fits = room >= length && room / 4 <= length.max(1024);
                if fits {
                    body.length = length;
                }
                fits
            })
        };
        // The one that was kept last is still in the processor's cache.
        match self.0.iter_mut().rposition(fits) {
            Some(at) => Some(self.0.swap_remove(at)),
            None => Body::new(length).map(Arc::new),
        }
    }

    /// A body with this content.
    pub(crate) fn copy(&mut self, content: &[u8]) -> Option<Arc<Body>> {
        let mut body = self.take(content.len())?;
        Arc::get_mut(&mut body)?
            .bytes_mut()
            .copy_from_slice(content);
        Some(body)
    }

    /// Keeps a body that is sent, for a message after its last reader.
    pub(crate) fn keep(&mut self, body: &Arc<Body>) {
        if body.room() > MOST_BYTES {
            return;
        }
        while self.0.len() == MOST || self.room() + body.room() > MOST_BYTES {
            self.0.remove(0);
        }
        self.0.push(Arc::clone(body));
    }

    fn room(&self) -> usize {
        self.0.iter().map(|body| body.room()).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_body_is_used_again_after_its_last_reader() {
        let mut pool = Pool::default();
        let first = pool.copy(&[7; 100]).expect("memory");
        pool.keep(&first);
        let reader = Arc::clone(&first);
        let address = first.bytes().as_ptr();
        assert_eq!(address.align_offset(16), 0);
        drop(first);
        let second = pool.copy(&[8; 100]).expect("memory");
        assert_ne!(second.bytes().as_ptr(), address, "it is being read");
        assert_eq!(reader.bytes(), [7; 100]);
        drop(reader);
        let third = pool.copy(&[9; 64]).expect("memory");
        assert_eq!(
            (third.bytes().as_ptr(), third.bytes()),
            (address, &[9; 64][..])
        );
        // More bodies than are kept.
        for _ in 0..2 * MOST {
            let body = pool.take(1).expect("memory");
            pool.keep(&body);
        }
        assert!(pool.0.len() <= MOST);
        // More bytes than are kept.
        for _ in 0..4 {
            let body = Body::new(MOST_BYTES / 3).expect("memory");
            pool.keep(&Arc::new(body));
        }
        assert!(pool.room() <= MOST_BYTES, "{}", pool.room());
        let huge = Body::new(MOST_BYTES + 1).expect("memory");
        pool.keep(&Arc::new(huge));
        assert!(pool.room() <= MOST_BYTES, "{}", pool.room());
    }
}
