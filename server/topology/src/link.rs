//! Links: β alone. What they do to cells is settled when the edit ends.

use crate::error::EditError;
use crate::map::SIDE;
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
    /// [`EditError::Unequal`], [`EditError::OpenFace`], [`EditError::SidesDiffer`].
    pub fn link3(&mut self, one: Dart, other: Dart) -> Result<(), EditError> {
        self.pair_faces(one, other)?;
        let [near, far] = [one, other].map(|dart| self.map.label[SIDE][dart.index()]);
        if near ^ 1 != far {
            self.unsettled_faces.push((one, None));
        }
        Ok(())
    }

    /// Frees β3 of all darts around the face of `dart`, and back. Returns the dart that β3(`dart`) was.
    ///
    /// # Errors
    /// [`EditError::NoDart`], [`EditError::Free`].
    pub fn unlink3(&mut self, dart: Dart) -> Result<Dart, EditError> {
        let other = self.unpair_faces(dart)?;
        self.unsettled_faces.push((dart, Some(other)));
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

    /// Leaves the pairs in [`Edit::pairs`].
    pub(crate) fn pair_faces(&mut self, one: Dart, other: Dart) -> Result<(), EditError> {
        self.linkable(3, one, other)?;
        if self.map.dimension == Dimension::Two {
            return Err(EditError::Surface { dart: one });
        }
        if let Some(&dart) = self.headless.first() {
            return Err(EditError::OpenFace { dart });
        }
        let map = &*self.map;
        let are_equal = map.face_pairs(one, other, &mut self.pairs);
        if self.pairs.iter().any(|&[near, _]| near == other) {
            return Err(EditError::SameSide { one, other });
        }
        if !are_equal {
            let [left, right] = [one, other].map(|dart| map.ring(dart).count());
            return Err(EditError::Unequal {
                one,
                other,
                left,
                right,
            });
        }
        // Where β1 was linked, a ring may be free in parts.
        let mut darts = self.pairs.as_flattened().iter();
        if let Some(&dart) = darts.find(|&&dart| map.beta3(dart).is_some()) {
            return Err(EditError::SidesDiffer { dart });
        }
        self.map.pair_faces(&self.pairs);
        self.changes.darts.extend(self.pairs.as_flattened());
        Ok(())
    }

    /// Leaves the pairs in [`Edit::pairs`], the first with `dart`.
    pub(crate) fn unpair_faces(&mut self, dart: Dart) -> Result<Dart, EditError> {
        let other = self.partner(3, dart)?;
        if let Some(&dart) = self.headless.first() {
            return Err(EditError::OpenFace { dart });
        }
        self.pairs.clear();
        let around = self.map.ring(dart);
        let pair = |dart| Some([dart, self.map.beta3(dart)?]);
        self.pairs.extend(around.filter_map(pair));
        self.map.unpair_faces(&self.pairs);
        self.changes.darts.extend(self.pairs.as_flattened());
        Ok(other)
    }
}
