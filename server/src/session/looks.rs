//! Looks at a session's world, which change nothing.

use sinew_engine::{Explanation, Modules, Selection};

use super::Actor;
use crate::error::{ServiceError, invalid};

impl Actor {
    pub(super) async fn explain(&mut self, vertex: u32) -> Result<Explanation, ServiceError> {
        let explained = self.lend(move |world| world.explain(vertex as usize)).await;
        explained.ok_or_else(|| self.lost())?.ok_or_else(|| {
            let count = self.last.vertices.len();
            let problem = format!("is {vertex}, and the mesh has {count} vertices");
            let remedy = "give the index of one, from 0";
            invalid("INDEX_OUT_OF_RANGE", "vertex", problem, remedy)
        })
    }

    pub(super) async fn read_modules(
        &mut self,
        selection: Selection,
    ) -> Result<Modules, ServiceError> {
        let read = self.lend(move |world| world.read_modules(&selection)).await;
        Ok(read.ok_or_else(|| self.lost())??)
    }
}
