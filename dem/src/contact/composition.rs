//! Which parts make a law, and the law they make.
//!
//! ```text
//! force  = (N - P) n + F_t        N normal part, P attraction of a cohesion, |F_t| ≤ μ |N|
//! moment = rolling and twisting parts, limited by |N|
//! ```
//! Friction and rolling resistance are limited by the *contact* force N without the cohesion's pull,
//! as in LAMMPS (DMT) and LIGGGHTS.
//!
//! | normal \ with | tangential | rolling | cohesion |
//! |---|---|---|---|
//! | Hooke | none, linear | none, EPSD, shape springs | any |
//! | Hertz | none, linear with κ in N/m, Mindlin | none, EPSD; with Mindlin also shape springs | any |
//! | viscoelastic | none, linear with κ in N/m, Mindlin | none, EPSD | any |
//! | JKR | none, its own | none, its own | none: its own |
//!
//! [`Composition::of`] refuses everything else with the reason.

use super::table::Table;
use super::{
    COEFFICIENTS, Cohesion, ContactLaw, HISTORY_MAX, Interaction, Normal, Rolling, SpringStiffness,
    Step, Stored, Tangential, Touch, Wrench,
};
use super::{cohesion, epsd, hertz, hooke, jkr, jkr_springs, mindlin, shape_springs};
use super::{table::LawTable, tangential, viscoelastic};
use crate::lanes::{Lane, Vec3};
use std::marker::PhantomData;

/// What the normal part tells the others.
#[derive(Clone, Copy)]
pub struct Pressing<L> {
    /// Normal force, positive when it pushes apart (N).
    pub force: L,
    /// Secant stiffness of its spring (N/m).
    pub stiffness: L,
    /// Coefficient of its dashpot (N s/m).
    pub damping: L,
    /// A measure that all stiffnesses of the contact grow with, where they grow; what a contact that holds
    /// across a gap remembers, above zero.
    pub memory: L,
}

/// What the tangential part tells the rolling part.
#[derive(Clone, Copy)]
pub struct Shear<L> {
    /// Force on `i` (N).
    pub force: Vec3<L>,
    /// Displacement left in the spring (m).
    pub spring: Vec3<L>,
    /// k_t (N/m).
    pub stiffness: L,
    /// C_t (N s/m).
    pub damping: L,
}

/// Rolling and twisting springs as a step finds them.
#[derive(Clone, Copy)]
pub struct Wound<L> {
    /// Rolling displacement (rad).
    pub rolled: Vec3<L>,
    /// Twisting displacement (rad).
    pub twisted: L,
    /// Share of them that a stiffer contact keeps.
    pub kept: L,
}

/// What the rolling part does.
#[derive(Clone, Copy)]
pub struct Turn<L> {
    /// Moment on `i` (N m).
    pub moment: Vec3<L>,
    /// Rolling displacement left (rad).
    pub rolled: Vec3<L>,
    /// Twisting displacement left (rad).
    pub twisted: L,
}

/// A normal law in the inner loop.
pub trait NormalPart: Copy + Send + Sync {
    /// Numbers of the law.
    const COEFFICIENTS: usize;
    /// Whether its stiffness grows with the overlap.
    const STIFFENS: bool;
    /// Whether an established contact holds across a gap.
    const HOLDS: bool;
    /// Force of an overlap and an approach speed (m/s); `memory` is what an established contact that holds
    /// remembers, zero for others.
    fn press<L: Lane>(c: &[L], touch: &Touch<L>, approach: L, memory: L) -> Pressing<L>;
    /// Gap up to which a contact holds (m) that remembers this; none for a memory of zero.
    fn hold<L: Lane>(c: &[L], memory: L) -> L;
    /// Energy stored (J).
    fn stored(c: &[f64], overlap: f64, curvature: f64) -> f64;
    /// Secant stiffness (N/m).
    fn secant(c: &[f64], overlap: f64, curvature: f64) -> f64;
}

/// A tangential law in the inner loop.
pub trait TangentialPart: Copy + Send + Sync {
    /// Numbers of the law.
    const COEFFICIENTS: usize;
    /// Whether there is a spring.
    const SPRING: bool;
    /// Whether its stiffness grows with the normal part's.
    const STIFFENS: bool;
    /// Force, from the spring as it was and the share of it that a stiffer contact keeps.
    fn shear<L: Lane>(
        c: &[L],
        touch: &Touch<L>,
        spring: Vec3<L>,
        kept: L,
        pressing: &Pressing<L>,
        step: Step,
    ) -> Shear<L>;
    /// k_t (N/m) over a contact.
    fn stiffness(c: &[f64], overlap: f64, curvature: f64) -> f64;
}

/// A rolling law in the inner loop.
pub trait RollingPart: Copy + Send + Sync {
    /// Numbers of the law.
    const COEFFICIENTS: usize;
    /// Whether it rolls at all.
    const SPRING: bool;
    /// Whether it twists.
    const TWISTS: bool;
    /// Whether its stiffness grows with the normal part's.
    const STIFFENS: bool;
    /// Whether it reads `Touch::inverse_inertia`.
    const INERTIA: bool;
    /// Moment, from the springs as they were.
    fn turn<L: Lane>(
        c: &[L],
        touch: &Touch<L>,
        wound: &Wound<L>,
        pressing: &Pressing<L>,
        shear: &Shear<L>,
        step: Step,
    ) -> Turn<L>;
    /// Rolling and twisting stiffness (N m/rad) over a contact of secant stiffness `normal` and
    /// tangential stiffness `tangential` (N/m).
    fn stiffness(c: &[f64], curvature: f64, normal: f64, tangential: f64) -> (f64, f64);
}

/// No tangential force.
#[derive(Clone, Copy, Debug)]
pub struct Frictionless;

impl TangentialPart for Frictionless {
    const COEFFICIENTS: usize = 0;
    const SPRING: bool = false;
    const STIFFENS: bool = false;

    #[inline(always)]
    fn shear<L: Lane>(
        _: &[L],
        _: &Touch<L>,
        _: Vec3<L>,
        _: L,
        _: &Pressing<L>,
        _: Step,
    ) -> Shear<L> {
        let zero = L::splat(0.0);
        Shear {
            force: Vec3::zero(),
            spring: Vec3::zero(),
            stiffness: zero,
            damping: zero,
        }
    }

    fn stiffness(_: &[f64], _: f64, _: f64) -> f64 {
        0.0
    }
}

/// Free rolling.
#[derive(Clone, Copy, Debug)]
pub struct Free;

impl RollingPart for Free {
    const COEFFICIENTS: usize = 0;
    const SPRING: bool = false;
    const TWISTS: bool = false;
    const STIFFENS: bool = false;
    const INERTIA: bool = false;

    #[inline(always)]
    fn turn<L: Lane>(
        _: &[L],
        _: &Touch<L>,
        _: &Wound<L>,
        _: &Pressing<L>,
        _: &Shear<L>,
        _: Step,
    ) -> Turn<L> {
        Turn {
            moment: Vec3::zero(),
            rolled: Vec3::zero(),
            twisted: L::splat(0.0),
        }
    }

    fn stiffness(_: &[f64], _: f64, _: f64, _: f64) -> (f64, f64) {
        (0.0, 0.0)
    }
}

/// A law made of parts, over the numbers of all pairs of materials.
#[derive(Debug)]
pub struct Composed<'a, N, T, R> {
    table: &'a Table,
    parts: PhantomData<(N, T, R)>,
}

impl<N, T, R> Clone for Composed<'_, N, T, R> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<N, T, R> Copy for Composed<'_, N, T, R> {}

impl<'a, N, T, R> Composed<'a, N, T, R> {
    /// The parts over a table that was written for them.
    pub fn new(table: &'a Table) -> Self {
        Composed {
            table,
            parts: PhantomData,
        }
    }
}

/// Where each part's history lies.
struct Layout<N, T, R>(PhantomData<(N, T, R)>);

impl<N: NormalPart, T: TangentialPart, R: RollingPart> Layout<N, T, R> {
    const ROLLED: usize = if T::SPRING { 3 } else { 0 };
    const FLIPS: usize = Self::ROLLED + if R::SPRING { 3 } else { 0 };
    const MEMORY: usize = Self::FLIPS + if R::TWISTS { 1 } else { 0 };
    /// Whether a spring follows a stiffness that changes.
    const REMEMBERS: bool = N::STIFFENS && (T::STIFFENS || R::STIFFENS);
    const WIDTH: usize = Self::MEMORY + if Self::REMEMBERS || N::HOLDS { 1 } else { 0 };
}

#[inline(always)]
fn vector<L: Lane>(history: &[L; HISTORY_MAX], from: usize) -> Vec3<L> {
    Vec3([history[from], history[from + 1], history[from + 2]])
}

impl<N, T, R> Interaction for Composed<'_, N, T, R>
where
    N: NormalPart,
    T: TangentialPart,
    R: RollingPart,
{
    // Lists tell a touching pair from a near one by its history: it is never empty.
    const HISTORY: usize = {
        assert!(Layout::<N, T, R>::WIDTH <= HISTORY_MAX);
        assert!(
            N::COEFFICIENTS + T::COEFFICIENTS + R::COEFFICIENTS + cohesion::COEFFICIENTS
                <= COEFFICIENTS
        );
        if Layout::<N, T, R>::WIDTH == 0 {
            1
        } else {
            Layout::<N, T, R>::WIDTH
        }
    };
    const FLIPS: usize = Layout::<N, T, R>::FLIPS;
    const ROLLING: bool = R::SPRING;
    const INERTIA: bool = R::INERTIA;
    const HOLDS: bool = N::HOLDS;

    #[inline(always)]
    fn table(&self) -> &[[f64; COEFFICIENTS]] {
        &self.table.rows
    }

    #[inline(always)]
    fn materials(&self) -> usize {
        self.table.materials
    }

    #[inline(always)]
    fn wrench<L: Lane>(
        &self,
        coefficients: &[L; COEFFICIENTS],
        touch: &Touch<L>,
        history: &mut [L; HISTORY_MAX],
        step: Step,
    ) -> Wrench<L> {
        let (n, rest) = coefficients.split_at(N::COEFFICIENTS);
        let (t, rest) = rest.split_at(T::COEFFICIENTS);
        let (r, c) = rest.split_at(R::COEFFICIENTS);
        let layout = Layout::<N, T, R>::MEMORY;
        let one = L::splat(1.0);
        let approach = -touch.velocity.dot(touch.normal);
        let remembered = if N::HOLDS {
            history[layout]
        } else {
            L::splat(0.0)
        };
        let pressing = N::press(n, touch, approach, remembered);
        let kept = if Layout::<N, T, R>::REMEMBERS {
            (history[layout] / pressing.memory).min(one)
        } else {
            one
        };
        let spring = if T::SPRING {
            vector(history, 0)
        } else {
            Vec3::zero()
        };
        let shear = T::shear(t, touch, spring, kept, &pressing, step);
        if T::SPRING {
            history[..3].copy_from_slice(&shear.spring.0);
        }
        let mut moment = Vec3::zero();
        if R::SPRING {
            let from = Layout::<N, T, R>::ROLLED;
            let wound = Wound {
                rolled: vector(history, from),
                twisted: if R::TWISTS {
                    history[Layout::<N, T, R>::FLIPS]
                } else {
                    L::splat(0.0)
                },
                kept,
            };
            let turn = R::turn(r, touch, &wound, &pressing, &shear, step);
            history[from..from + 3].copy_from_slice(&turn.rolled.0);
            if R::TWISTS {
                history[Layout::<N, T, R>::FLIPS] = turn.twisted;
            }
            moment = turn.moment;
        }
        if Layout::<N, T, R>::REMEMBERS || N::HOLDS {
            history[layout] = pressing.memory;
        }
        // A branch instead of a type: it costs nothing that can be measured, and halves the number of
        // inner loops.
        let normal = if self.table.cohesive {
            pressing.force - cohesion::pull(c, touch.curvature)
        } else {
            pressing.force
        };
        Wrench {
            force: touch.normal.scale(normal) + shear.force,
            tangential: shear.force,
            moment,
        }
    }

    #[inline(always)]
    fn hold<L: Lane>(&self, coefficients: &[L; COEFFICIENTS], memory: L) -> L {
        N::hold(&coefficients[..N::COEFFICIENTS], memory)
    }

    fn stored(
        &self,
        coefficients: &[f64; COEFFICIENTS],
        overlap: f64,
        curvature: f64,
        history: &[f64],
    ) -> Stored {
        let (n, rest) = coefficients.split_at(N::COEFFICIENTS);
        let (t, rest) = rest.split_at(T::COEFFICIENTS);
        let (r, c) = rest.split_at(R::COEFFICIENTS);
        let square = |from: usize| history[from..from + 3].iter().map(|x| x * x).sum::<f64>();
        let mut stored = Stored {
            normal: N::stored(n, overlap, curvature),
            cohesion: -cohesion::pull(c, curvature) * overlap.max(0.0),
            ..Stored::default()
        };
        let k_t = T::stiffness(t, overlap, curvature);
        if T::SPRING {
            stored.tangential = 0.5 * k_t * square(0);
        }
        if R::SPRING {
            let secant = N::secant(n, overlap, curvature);
            let (k_r, k_w) = R::stiffness(r, curvature, secant, k_t);
            stored.rolling = 0.5 * k_r * square(Layout::<N, T, R>::ROLLED);
            if R::TWISTS {
                stored.twisting = 0.5 * k_w * history[Layout::<N, T, R>::FLIPS].powi(2);
            }
        }
        stored
    }
}

/// Something to be done with a law whose composition is known at compile time.
pub trait Visitor {
    /// What it leaves.
    type Output;
    /// Does it.
    fn visit<I: Interaction>(self, law: &I) -> Self::Output;
}

macro_rules! compositions {
    ($($name:ident: $normal:ty, $tangential:ty, $rolling:ty;)*) => {
        /// The parts of a law that decide its inner loop.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[allow(missing_docs)]
        pub enum Composition { $($name),* }

        impl LawTable {
            /// Does something with the law; the one place where a scene's choice becomes a type.
            pub fn visit<V: Visitor>(&self, visitor: V) -> V::Output {
                match self.composition() {
                    $(
                        Composition::$name => visitor.visit(
                            &Composed::<$normal, $tangential, $rolling>::new(self.table()),
                        ),
                    )*
                }
            }
        }
    };
}

compositions! {
    HookeFree: hooke::Linear, Frictionless, Free;
    HookeLinear: hooke::Linear, tangential::Linear, Free;
    HookeLinearEpsd: hooke::Linear, tangential::Linear, epsd::Rolls;
    HookeLinearShape: hooke::Linear, tangential::Linear, shape_springs::Springs;
    HertzFree: hertz::Elastic, Frictionless, Free;
    HertzLinear: hertz::Elastic, tangential::Linear, Free;
    HertzLinearEpsd: hertz::Elastic, tangential::Linear, epsd::Rolls;
    HertzMindlin: hertz::Elastic, mindlin::Shears, Free;
    HertzMindlinEpsd: hertz::Elastic, mindlin::Shears, epsd::Rolls;
    HertzMindlinShape: hertz::Elastic, mindlin::Shears, shape_springs::Springs;
    ViscoelasticFree: viscoelastic::Viscous, Frictionless, Free;
    ViscoelasticLinear: viscoelastic::Viscous, tangential::Linear, Free;
    ViscoelasticLinearEpsd: viscoelastic::Viscous, tangential::Linear, epsd::Rolls;
    ViscoelasticMindlin: viscoelastic::Viscous, mindlin::Shears, Free;
    ViscoelasticMindlinEpsd: viscoelastic::Viscous, mindlin::Shears, epsd::Rolls;
    JkrFree: jkr::Adhesive, Frictionless, Free;
    JkrSliding: jkr::Adhesive, jkr_springs::Slides, Free;
    JkrSlidingRolling: jkr::Adhesive, jkr_springs::Slides, jkr_springs::Rolls;
}

/// Which kinds of parts the laws of all pairs of materials need together.
#[derive(Clone, Copy, Debug)]
struct Kinds {
    tangential: Tangential,
    rolling: Rolling,
    cohesive: bool,
}

impl Composition {
    /// The composition that holds all these laws, or why there is none.
    ///
    /// A part that only some of them name is given to the others with zero coefficients.
    pub fn of(laws: &[ContactLaw]) -> Result<Composition, &'static str> {
        let Some(first) = laws.first() else {
            return Err("there is no law");
        };
        let mut kinds = Kinds {
            tangential: Tangential::None,
            rolling: Rolling::None,
            cohesive: false,
        };
        for law in laws {
            if std::mem::discriminant(&law.normal) != std::mem::discriminant(&first.normal) {
                return Err("all pairs of materials must share one kind of normal law: \
                            two kinds would evaluate both at every contact");
            }
            if law.lever != first.lever {
                return Err("all pairs of materials must share one kind of lever arm");
            }
            kinds.join(law)?;
        }
        kinds.composition(&first.normal)
    }
}

impl Kinds {
    fn join(&mut self, law: &ContactLaw) -> Result<(), &'static str> {
        match (self.tangential, law.tangential) {
            (_, Tangential::None) => {}
            (Tangential::None, other) => self.tangential = other,
            (a, b) if std::mem::discriminant(&a) == std::mem::discriminant(&b) => {}
            _ => return Err("all pairs of materials must share one kind of tangential law"),
        }
        match (self.rolling, law.rolling) {
            (_, Rolling::None) => {}
            (Rolling::None, other) => self.rolling = other,
            (a, b) if std::mem::discriminant(&a) == std::mem::discriminant(&b) => {}
            _ => return Err("all pairs of materials must share one kind of rolling law"),
        }
        self.cohesive |= law.cohesion != Cohesion::None;
        if let (Normal::Hertz(_) | Normal::Viscoelastic(_), Tangential::Linear(spring)) =
            (&law.normal, &law.tangential)
            && let SpringStiffness::Ratio(_) = spring.stiffness
        {
            return Err(
                "a tangential spring in proportion to k_n needs a normal law with one k_n \
                        (Hooke): over an elastic contact give its stiffness in N/m, or use Mindlin",
            );
        }
        Ok(())
    }

    fn composition(self, normal: &Normal) -> Result<Composition, &'static str> {
        use Composition::*;
        if self.rolling != Rolling::None && self.tangential == Tangential::None {
            return Err(
                "rolling resistance without tangential force: grains that slip freely do \
                        not roll",
            );
        }
        Ok(match (normal, self.tangential, self.rolling) {
            (Normal::Jkr(_), _, _) if self.cohesive => {
                return Err(
                    "JKR contacts adhere by themselves: a cohesion on top would count the \
                            surface energy twice",
                );
            }
            (Normal::Jkr(_), Tangential::None, _) => JkrFree,
            (Normal::Jkr(_), Tangential::Jkr, Rolling::None) => JkrSliding,
            (Normal::Jkr(_), Tangential::Jkr, Rolling::Jkr) => JkrSlidingRolling,
            (Normal::Jkr(_), _, _) => {
                return Err(
                    "JKR contacts carry load in tension, where Coulomb's and the rolling \
                            limits μ|N| have no meaning: use their own sliding, rolling and twisting",
                );
            }
            (_, Tangential::Jkr, _) | (_, _, Rolling::Jkr) => {
                return Err(
                    "sliding, rolling and twisting of adhesive contacts need the JKR normal \
                            law: their constants are its equilibrium contact radius",
                );
            }
            (Normal::Hooke(_), Tangential::None, _) => HookeFree,
            (Normal::Hooke(_), Tangential::Linear(_), Rolling::None) => HookeLinear,
            (Normal::Hooke(_), Tangential::Linear(_), Rolling::Epsd(_)) => HookeLinearEpsd,
            (Normal::Hooke(_), Tangential::Linear(_), Rolling::Shape(_)) => HookeLinearShape,
            (Normal::Hooke(_), Tangential::Mindlin(_), _) => {
                return Err(
                    "Mindlin's stiffness grows with the contact radius of elastic spheres, \
                            which a linear spring does not have: use Hertz, or a linear spring",
                );
            }
            (Normal::Hertz(_), Tangential::None, _) => HertzFree,
            (Normal::Hertz(_), Tangential::Linear(_), Rolling::None) => HertzLinear,
            (Normal::Hertz(_), Tangential::Linear(_), Rolling::Epsd(_)) => HertzLinearEpsd,
            (Normal::Hertz(_), Tangential::Mindlin(_), Rolling::None) => HertzMindlin,
            (Normal::Hertz(_), Tangential::Mindlin(_), Rolling::Epsd(_)) => HertzMindlinEpsd,
            (Normal::Hertz(_), Tangential::Mindlin(_), Rolling::Shape(_)) => HertzMindlinShape,
            (Normal::Viscoelastic(_), Tangential::None, _) => ViscoelasticFree,
            (Normal::Viscoelastic(_), Tangential::Linear(_), Rolling::None) => ViscoelasticLinear,
            (Normal::Viscoelastic(_), Tangential::Linear(_), Rolling::Epsd(_)) => {
                ViscoelasticLinearEpsd
            }
            (Normal::Viscoelastic(_), Tangential::Mindlin(_), Rolling::None) => ViscoelasticMindlin,
            (Normal::Viscoelastic(_), Tangential::Mindlin(_), Rolling::Epsd(_)) => {
                ViscoelasticMindlinEpsd
            }
            (_, _, Rolling::Shape(_)) => {
                return Err(
                    "shape springs take k_t from their tangential law: over an elastic \
                            contact use them with Mindlin",
                );
            }
        })
    }
}
