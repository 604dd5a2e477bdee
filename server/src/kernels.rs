//! Where the kernels run: worker threads of their own, away from the RPCs.

use std::{panic::AssertUnwindSafe, sync::Arc};

use rayon::ThreadPool;
use tokio::sync::oneshot;

/// The kernels' threads, shared by all sessions.
#[derive(Clone)]
pub(crate) struct Kernels(Arc<ThreadPool>);

impl Kernels {
    /// `threads` workers; 0 for one per core.
    pub(crate) fn start(threads: usize) -> Result<Self, rayon::ThreadPoolBuildError> {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .thread_name(|i| format!("kernel-{i}"))
            .build()?;
        Ok(Self(Arc::new(pool)))
    }

    /// Runs `work` on a worker.
    ///
    /// # Errors
    /// The panic's message where `work` panics: it costs its caller, nobody else.
    pub(crate) async fn run<T: Send + 'static>(
        &self,
        work: impl FnOnce() -> T + Send + 'static,
    ) -> Result<T, String> {
        let (done, outcome) = oneshot::channel();
        self.0.spawn(move || {
            let result = std::panic::catch_unwind(AssertUnwindSafe(work));
            done.send(result).ok(); // the caller may have left
        });
        match outcome.await {
            Ok(Ok(value)) => Ok(value),
            Ok(Err(panic)) => Err(message(panic.as_ref())),
            Err(_) => Err("the worker stopped".to_owned()),
        }
    }
}

fn message(panic: &(dyn std::any::Any + Send)) -> String {
    panic
        .downcast_ref::<String>()
        .cloned()
        .or_else(|| panic.downcast_ref::<&str>().map(|text| (*text).to_owned()))
        .unwrap_or_else(|| "a panic without a message".to_owned())
}
