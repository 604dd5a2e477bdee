//! Links: β alone. What they do to cells is settled when the edit ends.

use crate::error::EditError;
use crate::{Dart, Dimension, Edit};

impl Edit<'_> {
    /// A dart that is linked to nothing.
    ///
    /// # Errors
    /// [`EditError::Full`].
    pub fn add_dart(&mut self) -> Result<Dart, EditError> {
        self.room(1)?;
        let dart = self.map.new_dart();
        self.headless.push(dart);
        self.unsettled.push(dart);
        self.has_borders = true;
        Ok(dart)
    }

    /// Lets β1(`from`) = `to`, on one side of the face alone.
    ///
    /// # Errors
    /// [`EditError::NoDart`]; [`EditError::NotFree`] if either has its neighbour already.
    pub fn link1(&mut self, from: Dart, to: Dart) -> Result<(), EditError> {
        self.known(from)?;
        self.known(to)?;
        let not_free = |taken| EditError::NotFree {
            beta: 1,
            one: from,
            other: to,
            taken,
        };
        if self.map.beta[0][from.index()].is_some() {
            return Err(not_free(from));
        }
        // The last come first: faces are linked as soon as their darts are made.
        let Some(head) = self.headless.iter().rposition(|&dart| dart == to) else {
            return Err(not_free(to));
        };
        self.headless.swap_remove(head);
        self.map.set_beta(1, from, Some(to));
        self.unsettle1(from, to);
        Ok(())
    }

    /// Frees β1(`from`), on one side of the face alone. Returns the dart that it was.
    ///
    /// # Errors
    /// [`EditError::NoDart`], [`EditError::Free`].
    pub fn unlink1(&mut self, from: Dart) -> Result<Dart, EditError> {
        self.known(from)?;
        let Some(to) = self.map.beta[0][from.index()] else {
            return Err(EditError::Free {
                beta: 1,
                dart: from,
            });
        };
        self.map.set_beta(1, from, None);
        self.headless.push(to);
        self.unsettle1(from, to);
        Ok(to)
    }

    fn unsettle1(&mut self, from: Dart, to: Dart) {
        // Whatever leaves the vertex between them may lose or gain it.
        let beyond = [1, 2].map(|beta| self.map.beta[beta][from.index()]);
        let darts = [Some(from), Some(to), beyond[0], beyond[1]];
        self.unsettled.extend(darts.into_iter().flatten());
    }

    /// Lets β2(`one`) = `other` and back.
    ///
    /// # Errors
    /// [`EditError::NoDart`], [`EditError::Itself`], [`EditError::NotFree`].
    pub fn link2(&mut self, one: Dart, other: Dart) -> Result<(), EditError> {
        self.linkable(2, one, other)?;
        self.pair(2, one, other);
        self.unsettle2(one, other);
        Ok(())
    }

    /// Frees β2(`dart`) and back. Returns the dart that it was.
    ///
    /// # Errors
    /// [`EditError::NoDart`], [`EditError::Free`].
    pub fn unlink2(&mut self, dart: Dart) -> Result<Dart, EditError> {
        let other = self.partner(2, dart)?;
        self.map.set_beta(2, dart, None);
        self.map.set_beta(2, other, None);
        self.unsettle2(dart, other);
        self.has_borders = true;
        Ok(other)
    }

    fn unsettle2(&mut self, one: Dart, other: Dart) {
        let next = [one, other].map(|dart| self.map.beta[0][dart.index()]);
        let darts = [Some(one), Some(other), next[0], next[1]];
        self.unsettled.extend(darts.into_iter().flatten());
    }

    /// Lets β3 join the faces of `one` and `other`, these two darts with each other and the rest along the rings.
    ///
    /// # Errors
    /// [`EditError::NoDart`], [`EditError::Surface`], [`EditError::NotFree`], [`EditError::SameSide`],
    /// [`EditError::Unequal`], [`EditError::OpenFace`].
    pub fn link3(&mut self, one: Dart, other: Dart) -> Result<(), EditError> {
        self.pair_faces(one, other)?;
        self.unsettled_faces.push(one);
        Ok(())
    }

    /// Frees β3 of all darts around the face of `dart`, and back. Returns the dart that β3(`dart`) was.
    ///
    /// # Errors
    /// [`EditError::NoDart`], [`EditError::Free`].
    pub fn unlink3(&mut self, dart: Dart) -> Result<Dart, EditError> {
        let other = self.unpair_faces(dart)?;
        self.unsettled_faces.extend([dart, other]);
        Ok(other)
    }

    /// That the two are darts, different, and free under β2 or β3.
    fn linkable(&self, beta: u8, one: Dart, other: Dart) -> Result<(), EditError> {
        self.known(one)?;
        self.known(other)?;
        if one == other {
            return Err(EditError::Itself { beta, dart: one });
        }
        let column = &self.map.beta[usize::from(beta) - 1];
        match [one, other]
            .into_iter()
            .find(|d| column[d.index()].is_some())
        {
            None => Ok(()),
            Some(taken) => Err(EditError::NotFree {
                beta,
                one,
                other,
                taken,
            }),
        }
    }

    /// β2 or β3 of `dart`.
    fn partner(&self, beta: u8, dart: Dart) -> Result<Dart, EditError> {
        self.known(dart)?;
        let partner = self.map.beta[usize::from(beta) - 1][dart.index()];
        partner.ok_or(EditError::Free { beta, dart })
    }

    pub(crate) fn pair_faces(&mut self, one: Dart, other: Dart) -> Result<(), EditError> {
        self.linkable(3, one, other)?;
        if self.map.dimension == Dimension::Two {
            return Err(EditError::Surface { dart: one });
        }
        if let Some(&dart) = self.headless.first() {
            return Err(EditError::OpenFace { dart });
        }
        let map = &*self.map;
        let [a1, b1] = [one, other].map(|dart| map.beta1(dart));
        let [a2, b2] = [a1, b1].map(|dart| map.beta1(dart));
        if [map.beta1(a2), map.beta1(b2)] == [one, other] && a1 != other && a2 != other {
            self.pair(3, one, other);
            self.pair(3, a1, b2);
            self.pair(3, a2, b1);
            return Ok(());
        }
        let (mut left, mut right) = (1, 1);
        let (mut at, mut facing) = (a1, b1);
        while at != one {
            if at == other {
                return Err(EditError::SameSide { one, other });
            }
            (at, left) = (map.beta1(at), left + 1);
        }
        while facing != other {
            (facing, right) = (map.beta1(facing), right + 1);
        }
        if left != right {
            return Err(EditError::Unequal {
                one,
                other,
                left,
                right,
            });
        }
        // The other ring runs against this one: `one` with `other`, the next with the one before `other`.
        let backward: Vec<_> = map.ring(b1).collect();
        let mut at = one;
        for &facing in backward.iter().rev() {
            self.pair(3, at, facing);
            at = self.map.beta1(at);
        }
        Ok(())
    }

    pub(crate) fn unpair_faces(&mut self, dart: Dart) -> Result<Dart, EditError> {
        let other = self.partner(3, dart)?;
        if let Some(&dart) = self.headless.first() {
            return Err(EditError::OpenFace { dart });
        }
        let mut at = dart;
        loop {
            if let Some(facing) = self.map.beta3(at) {
                self.map.set_beta(3, at, None);
                self.map.set_beta(3, facing, None);
            }
            at = self.map.beta1(at);
            if at == dart {
                return Ok(other);
            }
        }
    }
}
