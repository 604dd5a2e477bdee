//! Who streams motion to a session: one source at a time.

use std::sync::{Mutex, MutexGuard, PoisonError};

use tokio_util::sync::CancellationToken;

use crate::error::ServiceError;

/// The place of a session's source. Its lock is held for a look, never across an await.
#[derive(Debug, Default)]
pub(crate) struct Seat(Mutex<Taken>);

#[derive(Debug, Default)]
struct Taken {
    /// The highest so far.
    epoch: u64,
    streams: u64,
    /// The stream in the place, and how it is told to leave.
    holder: Option<(u64, CancellationToken)>,
}

impl Seat {
    fn lock(&self) -> MutexGuard<'_, Taken> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Takes the place: the stream's number, and what tells it that another took over.
    pub(crate) fn take(&self, epoch: u64) -> Result<(u64, CancellationToken), ServiceError> {
        let mut seat = self.lock();
        let last = seat.epoch;
        if epoch > 0 && epoch < last {
            return Err(ServiceError::MotionEpochStale { epoch, last });
        }
        if let Some((_, superseded)) = &seat.holder {
            if epoch <= last {
                return Err(ServiceError::MotionSourceBusy);
            }
            superseded.cancel();
        }
        seat.epoch = last.max(epoch);
        seat.streams += 1;
        let superseded = CancellationToken::new();
        seat.holder = Some((seat.streams, superseded.clone()));
        Ok((seat.streams, superseded))
    }

    /// Leaves the place, unless another has it.
    pub(crate) fn leave(&self, stream: u64) {
        let mut seat = self.lock();
        if seat
            .holder
            .as_ref()
            .is_some_and(|(holder, _)| *holder == stream)
        {
            seat.holder = None;
        }
    }
}
