//! The bones of a humanoid, and where they are in the world.

use nalgebra::Isometry3;

/// Bones with their parents, parents first: Unity's `HumanBodyBones`.
const BONES: [(&str, &str); 55] = [
    ("Hips", "root"),
    ("Spine", "Hips"),
    ("Chest", "Spine"),
    ("UpperChest", "Chest"),
    ("Neck", "UpperChest"),
    ("Head", "Neck"),
    ("LeftEye", "Head"),
    ("RightEye", "Head"),
    ("Jaw", "Head"),
    ("LeftShoulder", "UpperChest"),
    ("LeftUpperArm", "LeftShoulder"),
    ("LeftLowerArm", "LeftUpperArm"),
    ("LeftHand", "LeftLowerArm"),
    ("RightShoulder", "UpperChest"),
    ("RightUpperArm", "RightShoulder"),
    ("RightLowerArm", "RightUpperArm"),
    ("RightHand", "RightLowerArm"),
    ("LeftUpperLeg", "Hips"),
    ("LeftLowerLeg", "LeftUpperLeg"),
    ("LeftFoot", "LeftLowerLeg"),
    ("LeftToes", "LeftFoot"),
    ("RightUpperLeg", "Hips"),
    ("RightLowerLeg", "RightUpperLeg"),
    ("RightFoot", "RightLowerLeg"),
    ("RightToes", "RightFoot"),
    ("LeftThumbProximal", "LeftHand"),
    ("LeftThumbIntermediate", "LeftThumbProximal"),
    ("LeftThumbDistal", "LeftThumbIntermediate"),
    ("LeftIndexProximal", "LeftHand"),
    ("LeftIndexIntermediate", "LeftIndexProximal"),
    ("LeftIndexDistal", "LeftIndexIntermediate"),
    ("LeftMiddleProximal", "LeftHand"),
    ("LeftMiddleIntermediate", "LeftMiddleProximal"),
    ("LeftMiddleDistal", "LeftMiddleIntermediate"),
    ("LeftRingProximal", "LeftHand"),
    ("LeftRingIntermediate", "LeftRingProximal"),
    ("LeftRingDistal", "LeftRingIntermediate"),
    ("LeftLittleProximal", "LeftHand"),
    ("LeftLittleIntermediate", "LeftLittleProximal"),
    ("LeftLittleDistal", "LeftLittleIntermediate"),
    ("RightThumbProximal", "RightHand"),
    ("RightThumbIntermediate", "RightThumbProximal"),
    ("RightThumbDistal", "RightThumbIntermediate"),
    ("RightIndexProximal", "RightHand"),
    ("RightIndexIntermediate", "RightIndexProximal"),
    ("RightIndexDistal", "RightIndexIntermediate"),
    ("RightMiddleProximal", "RightHand"),
    ("RightMiddleIntermediate", "RightMiddleProximal"),
    ("RightMiddleDistal", "RightMiddleIntermediate"),
    ("RightRingProximal", "RightHand"),
    ("RightRingIntermediate", "RightRingProximal"),
    ("RightRingDistal", "RightRingIntermediate"),
    ("RightLittleProximal", "RightHand"),
    ("RightLittleIntermediate", "RightLittleProximal"),
    ("RightLittleDistal", "RightLittleIntermediate"),
];

fn parent(bone: &str) -> Option<&'static str> {
    let found = BONES.iter().find(|(name, _)| *name == bone);
    found.map(|(_, parent)| *parent)
}

/// For each label the one that its pose is told in, if any: the nearest ancestor among the labels. Bones that an avatar
/// lacks (a chest, shoulders) are passed over, and so is a root that is not sent.
pub(super) fn parents(labels: &[String]) -> Vec<Option<usize>> {
    let find = |name: &str| labels.iter().position(|label| label == name);
    let ancestor = |label: &String| {
        let mut name = parent(label)?;
        loop {
            if let Some(found) = find(name) {
                return Some(found);
            }
            name = parent(name)?;
        }
    };
    labels.iter().map(ancestor).collect()
}

/// Poses in the world, of poses each told in its parent's. `None` where one on the way to the root is not known.
pub(super) fn in_world(
    parents: &[Option<usize>],
    local: &[Option<Isometry3<f64>>],
) -> Vec<Option<Isometry3<f64>>> {
    let pose = |mut bone: usize| {
        let mut world = local[bone]?;
        // Bones are a tree of the table above, so that this ends.
        while let Some(parent) = parents[bone] {
            world = local[parent]? * world;
            bone = parent;
        }
        Some(world)
    };
    (0..local.len()).map(pose).collect()
}

#[cfg(test)]
mod tests {
    use nalgebra::{UnitQuaternion, Vector3};

    use super::*;

    #[test]
    fn every_bone_stands_after_its_parent() {
        for (i, (_, parent)) in BONES.iter().enumerate() {
            let known = BONES[..i].iter().any(|(name, _)| name == parent);
            assert!(known || *parent == "root", "{parent}");
        }
    }

    #[test]
    fn a_bone_that_is_not_sent_is_passed_over() {
        let labels = ["Head", "Hips", "Spine", "a tracker"].map(str::to_owned);
        assert_eq!(parents(&labels), [Some(2), None, Some(1), None]);
    }

    #[test]
    fn poses_add_up_along_the_bones() {
        let labels = ["root", "Hips", "Spine", "Chest"].map(str::to_owned);
        let quarter = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 90_f64.to_radians());
        let step = Isometry3::from_parts(Vector3::x().into(), quarter);
        let mut local = vec![Some(step); 4];
        let at = |poses: &[Option<Isometry3<f64>>], i: usize| poses[i].unwrap().translation.vector;
        let world = in_world(&parents(&labels), &local);
        // One to the right, then up, then to the left, then down.
        for (i, place) in [[1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.0, 0.0]]
            .into_iter()
            .enumerate()
        {
            let expected = Vector3::new(place[0], place[1], 0.0);
            assert!((at(&world, i) - expected).norm() < 1e-15);
        }
        local[1] = None;
        let world = in_world(&parents(&labels), &local);
        assert!(world[0].is_some() && world[1..].iter().all(Option::is_none));
    }
}
