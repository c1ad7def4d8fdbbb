//! Work on all processors.

use std::num::NonZero;
use std::sync::{LazyLock, Mutex};
use std::thread::available_parallelism;

/// The processors that this program may use. Finding their number reads several files.
static PROCESSORS: LazyLock<usize> =
    LazyLock::new(|| available_parallelism().map_or(1, NonZero::get));

/// Runs `work` on all jobs by several threads. Returns the results in the order of the jobs.
pub fn map<J: Send, T: Send>(jobs: &mut [J], work: impl Fn(&mut J) -> T + Sync) -> Vec<T> {
    let others = PROCESSORS.min(jobs.len()).saturating_sub(1);
    let queue = Mutex::new(jobs.iter_mut().enumerate());
    let run = || {
        let mut done = Vec::new();
        loop {
            let job = queue.lock().ok().and_then(|mut queue| queue.next());
            let Some((at, job)) = job else {
                return done;
            };
            done.push((at, work(job)));
        }
    };
    let mut done = std::thread::scope(|scope| {
        let others: Vec<_> = (0..others).map(|_| scope.spawn(run)).collect();
        let mut done = run();
        for other in others {
            match other.join() {
                Ok(more) => done.extend(more),
                Err(panic) => std::panic::resume_unwind(panic),
            }
        }
        done
    });
    done.sort_by_key(|(at, _)| *at);
    done.into_iter().map(|(_, made)| made).collect()
}

/// Runs two closures by two threads and returns both results.
pub fn both<A: Send, B>(a: impl FnOnce() -> A + Send, b: impl FnOnce() -> B) -> (A, B) {
    std::thread::scope(|scope| {
        let a = scope.spawn(a);
        let b = b();
        match a.join() {
            Ok(a) => (a, b),
            Err(panic) => std::panic::resume_unwind(panic),
        }
    })
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_order_of_the_jobs_stays() {
        let mut jobs: Vec<usize> = (0..1000).collect();
        let made = super::map(&mut jobs, |job| *job * 2);
        assert_eq!(made, (0..2000).step_by(2).collect::<Vec<_>>());
        assert!(super::map(&mut [(); 0], |()| ()).is_empty());
    }
}
