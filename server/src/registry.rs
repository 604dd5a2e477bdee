//! The sessions by name. Locks here are held for a look-up, never across a step or an await.

use std::{
    collections::BTreeMap,
    ops::Bound,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    time::SystemTime,
};

use sinew_engine::UpAxis;

use crate::{end::End, error::ServiceError, seat::Seat, session::Handle};

/// A session and what of it never changes.
pub(crate) struct Entry {
    /// `sessions/{id}`.
    pub(crate) name: String,
    pub(crate) title: String,
    pub(crate) create_time: SystemTime,
    pub(crate) labels: Vec<String>,
    pub(crate) time_step: f64,
    pub(crate) external: bool,
    pub(crate) warnings: Vec<String>,
    pub(crate) handle: Handle,
    pub(crate) up: UpAxis,
    /// The place of its source of motion.
    pub(crate) seat: Seat,
}

/// The request that makes or made a session.
#[derive(Clone, PartialEq, Eq)]
pub(crate) struct Origin {
    /// Empty where the client gave none.
    pub(crate) request_id: String,
    /// Hash of the request.
    pub(crate) hash: u128,
}

struct Slot {
    origin: Origin,
    /// None while the world is built.
    entry: Option<Arc<Entry>>,
}

/// What became of a reservation.
pub(crate) enum Reserved {
    /// Build the world, then [`Reservation::fill`].
    New(Reservation),
    /// The same request made this session before.
    Known(Arc<Entry>),
}

/// All sessions of this process.
pub(crate) struct Registry {
    slots: Mutex<BTreeMap<String, Slot>>,
    capacity: usize,
}

impl Registry {
    pub(crate) fn new(capacity: usize) -> Self {
        Self {
            slots: Mutex::default(),
            capacity,
        }
    }

    fn lock(&self) -> MutexGuard<'_, BTreeMap<String, Slot>> {
        // A panic between two map operations leaves the map whole.
        self.slots.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Takes a name for a session to be built.
    pub(crate) fn reserve(
        self: &Arc<Self>,
        name: &str,
        origin: Origin,
    ) -> Result<Reserved, ServiceError> {
        let mut slots = self.lock();
        if let Some((known, slot)) = slots.iter().find(|(_, slot)| {
            !origin.request_id.is_empty() && slot.origin.request_id == origin.request_id
        }) {
            if slot.origin != origin {
                return Err(ServiceError::RequestIdReused(origin.request_id));
            }
            return match &slot.entry {
                Some(entry) => Ok(Reserved::Known(Arc::clone(entry))),
                None => Err(ServiceError::SessionBeingCreated(known.clone())),
            };
        }
        if slots.contains_key(name) {
            return Err(ServiceError::SessionExists(name.to_owned()));
        }
        if slots.len() >= self.capacity {
            return Err(ServiceError::TooManySessions(self.capacity));
        }
        slots.insert(
            name.to_owned(),
            Slot {
                origin,
                entry: None,
            },
        );
        Ok(Reserved::New(Reservation {
            registry: Arc::clone(self),
            name: name.to_owned(),
        }))
    }

    pub(crate) fn get(&self, name: &str) -> Result<Arc<Entry>, ServiceError> {
        let slots = self.lock();
        let slot = slots
            .get(name)
            .ok_or_else(|| ServiceError::SessionUnknown(name.to_owned()))?;
        slot.entry
            .clone()
            .ok_or_else(|| ServiceError::SessionBeingCreated(name.to_owned()))
    }

    /// Up to `limit` sessions whose names follow `after`.
    pub(crate) fn page(&self, after: &str, limit: usize) -> Vec<Arc<Entry>> {
        self.lock()
            .range::<str, _>((Bound::Excluded(after), Bound::Unbounded))
            .filter_map(|(_, slot)| slot.entry.clone())
            .take(limit)
            .collect()
    }

    /// Ends a session.
    pub(crate) fn remove(&self, name: &str) -> Result<(), ServiceError> {
        let entry = self.get(name)?;
        self.lock().remove(name);
        stop(&entry, End::Deleted);
        Ok(())
    }

    /// Ends all sessions.
    pub(crate) fn shut_down(&self) {
        for slot in std::mem::take(&mut *self.lock()).into_values() {
            if let Some(entry) = slot.entry {
                stop(&entry, End::Shutdown);
            }
        }
    }

    pub(crate) fn len(&self) -> usize {
        self.lock().len()
    }
}

fn stop(entry: &Entry, end: End) {
    entry.handle.outlets.announce(end);
    entry.handle.cancel.cancel();
}

/// A name taken; free again when dropped unfilled.
pub(crate) struct Reservation {
    registry: Arc<Registry>,
    name: String,
}

impl Reservation {
    /// Puts the session in its place.
    ///
    /// # Errors
    /// [`ServiceError::ShuttingDown`] where the place is gone.
    pub(crate) fn fill(self, entry: Entry) -> Result<Arc<Entry>, ServiceError> {
        let entry = Arc::new(entry);
        match self.registry.lock().get_mut(&self.name) {
            Some(slot) => slot.entry = Some(Arc::clone(&entry)),
            None => {
                stop(&entry, End::Shutdown);
                return Err(ServiceError::ShuttingDown);
            }
        }
        Ok(entry)
    }
}

impl Drop for Reservation {
    fn drop(&mut self) {
        let mut slots = self.registry.lock();
        if slots
            .get(&self.name)
            .is_some_and(|slot| slot.entry.is_none())
        {
            slots.remove(&self.name);
        }
    }
}
