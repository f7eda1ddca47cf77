//! Laws of all pairs of materials.
//!
//! A scene names the law of each material against itself and, where it knows better, of pairs. What it
//! does not name is mixed:
//!
//! * stiffnesses and moduli by the harmonic mean: two surfaces are springs in series. For Hertz and
//!   Mindlin this is exact, since 1/E* and 1/G* are sums over the two surfaces;
//! * restitution, friction coefficients, surface energies, strengths and everything else by the
//!   geometric mean (LAMMPS' rule; Berthelot's for surface energies);
//! * a part that only one of the two has (cohesion, rolling resistance) is absent between them.

use super::composition::Composition;
use super::{
    COEFFICIENTS, Cohesion, ContactLaw, Damping, Elasticity, Epsd, Hertz, Hooke, Jkr, Lever,
    Mindlin, Normal, Rolling, ShapeParameter, SpringStiffness, Tangential, TangentialSpring,
    Viscoelastic,
};
use crate::setup::{SetupError, check};

/// Numbers of all pairs, as the inner loop reads them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table {
    /// Row `first · materials + second`.
    pub(crate) rows: Vec<[f64; COEFFICIENTS]>,
    /// Number of materials.
    pub(crate) materials: usize,
    /// Whether any pair has a cohesion.
    pub(crate) cohesive: bool,
}

/// The laws that a scene names.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Laws {
    /// Each material against itself.
    pub own: Vec<ContactLaw>,
    /// Pairs of materials where the mixing rule is not wanted: (first, second, law).
    pub pairs: Vec<(usize, usize, ContactLaw)>,
}

impl From<ContactLaw> for Laws {
    fn from(law: ContactLaw) -> Laws {
        Laws {
            own: vec![law],
            pairs: Vec::new(),
        }
    }
}

/// Laws of all pairs of materials, checked and of one composition.
#[derive(Clone, Debug, PartialEq)]
pub struct LawTable {
    laws: Vec<ContactLaw>,
    composition: Composition,
    table: Table,
}

impl LawTable {
    /// Checks the laws of a scene and fills in the pairs it does not name.
    pub fn new(given: &Laws) -> Result<LawTable, SetupError> {
        let n = given.own.len();
        let mut laws = Vec::with_capacity(n * n);
        for (i, a) in given.own.iter().enumerate() {
            for (j, b) in given.own.iter().enumerate() {
                let named =
                    |p: &&(usize, usize, ContactLaw)| (p.0, p.1) == (i, j) || (p.1, p.0) == (i, j);
                laws.push(match given.pairs.iter().find(named) {
                    Some(&(_, _, law)) => law,
                    None => mix(a, b)?,
                });
            }
        }
        for &(a, b, _) in &given.pairs {
            if a >= n || b >= n {
                return Err(SetupError::Material {
                    material: a.max(b),
                    materials: n,
                });
            }
            let alike = |p: &&(usize, usize, ContactLaw)| [(a, b), (b, a)].contains(&(p.0, p.1));
            let times = given.pairs.iter().filter(alike).count() as f64;
            let key = format!("contact: laws given for the materials {a} and {b}, their number");
            check(&key, times, "1", |n| n == 1.0)?;
        }
        LawTable::pairs(n, laws)
    }

    fn pairs(materials: usize, laws: Vec<ContactLaw>) -> Result<LawTable, SetupError> {
        for law in &laws {
            law.validate()?;
        }
        let composition = Composition::of(&laws).map_err(SetupError::Composition)?;
        let table = Table {
            rows: laws.iter().map(|law| row(law, &laws)).collect(),
            materials,
            cohesive: laws.iter().any(|law| law.cohesion != Cohesion::None),
        };
        Ok(LawTable {
            laws,
            composition,
            table,
        })
    }

    /// Number of materials.
    pub fn materials(&self) -> usize {
        self.table.materials
    }

    /// Law between two materials.
    pub fn between(&self, first: usize, second: usize) -> &ContactLaw {
        &self.laws[first * self.table.materials + second]
    }

    /// Laws of all pairs, `first · materials + second`.
    pub fn laws(&self) -> &[ContactLaw] {
        &self.laws
    }

    /// Which inner loop the laws need.
    pub fn composition(&self) -> Composition {
        self.composition
    }

    /// Where the contact point lies.
    pub fn lever(&self) -> Lever {
        self.laws[0].lever
    }

    /// What coefficients do not tell: parts, lever arm and number of materials.
    pub(crate) fn kind(&self) -> [u64; 3] {
        [
            self.composition as u64,
            self.lever() as u64,
            self.table.materials as u64,
        ]
    }

    pub(crate) fn table(&self) -> &Table {
        &self.table
    }
}

/// Coefficients in the order of the parts; parts that only other laws have are zero.
fn row(law: &ContactLaw, all: &[ContactLaw]) -> [f64; COEFFICIENTS] {
    let mut row = [0.0; COEFFICIENTS];
    let mut at = 0;
    let mut put = |numbers: &[f64]| {
        row[at..at + numbers.len()].copy_from_slice(numbers);
        at += numbers.len();
    };
    match &law.normal {
        Normal::Hooke(hooke) => put(&hooke.coefficients()),
        Normal::Hertz(hertz) => put(&hertz.coefficients()),
        Normal::Viscoelastic(viscoelastic) => put(&viscoelastic.coefficients()),
        Normal::Jkr(jkr) => put(&jkr.coefficients()),
    }
    match (&law.tangential, &law.normal) {
        (Tangential::Linear(spring), normal) => put(&spring.coefficients(normal)),
        (Tangential::Mindlin(mindlin), _) => put(&mindlin.coefficients()),
        (Tangential::Jkr, Normal::Jkr(jkr)) => put(&jkr.sliding_coefficients()),
        (Tangential::None | Tangential::Jkr, _) => {
            let width = |l: &ContactLaw| match l.tangential {
                Tangential::None => 0,
                Tangential::Linear(_) | Tangential::Mindlin(_) => 4,
                Tangential::Jkr => 3,
            };
            put(&[0.0; 4][..all.iter().map(width).max().unwrap_or(0)]);
        }
    }
    match (&law.rolling, &law.normal) {
        (Rolling::Epsd(epsd), _) => put(&epsd.coefficients()),
        (Rolling::Shape(shape), _) => put(&shape.coefficients(&law.tangential)),
        (Rolling::Jkr, Normal::Jkr(jkr)) => put(&jkr.rolling_coefficients()),
        (Rolling::None | Rolling::Jkr, _) => {
            let width = |l: &ContactLaw| match l.rolling {
                Rolling::None => 0,
                Rolling::Epsd(_) => 2,
                Rolling::Shape(_) | Rolling::Jkr => 3,
            };
            put(&[0.0; 4][..all.iter().map(width).max().unwrap_or(0)]);
        }
    }
    put(&law.cohesion.coefficients());
    row
}

fn geometric(a: f64, b: f64) -> f64 {
    (a * b).sqrt()
}

fn harmonic(a: f64, b: f64) -> f64 {
    2.0 * a * b / (a + b)
}

/// The law between two materials from the law of each against itself.
pub fn mix(a: &ContactLaw, b: &ContactLaw) -> Result<ContactLaw, SetupError> {
    if a == b {
        return Ok(*a);
    }
    let unlike = |part: &str| SetupError::Mixture(part.to_string());
    if a.lever != b.lever {
        return Err(unlike("lever arm"));
    }
    Ok(ContactLaw {
        normal: mix_normal(&a.normal, &b.normal).ok_or_else(|| unlike("normal law"))?,
        tangential: mix_tangential(&a.tangential, &b.tangential)
            .ok_or_else(|| unlike("tangential law"))?,
        rolling: mix_rolling(&a.rolling, &b.rolling).ok_or_else(|| unlike("rolling law"))?,
        cohesion: mix_cohesion(&a.cohesion, &b.cohesion).ok_or_else(|| unlike("cohesion"))?,
        lever: a.lever,
    })
}

fn mix_damping(a: &Damping, b: &Damping) -> Option<Damping> {
    match (a, b) {
        (Damping::Restitution(a), Damping::Restitution(b)) => {
            Some(Damping::Restitution(geometric(*a, *b)))
        }
        (Damping::MassProportional(a), Damping::MassProportional(b)) => {
            Some(Damping::MassProportional(geometric(*a, *b)))
        }
        _ => None,
    }
}

fn mix_normal(a: &Normal, b: &Normal) -> Option<Normal> {
    Some(match (a, b) {
        (Normal::Hooke(a), Normal::Hooke(b)) => Normal::Hooke(Hooke {
            stiffness: harmonic(a.stiffness, b.stiffness),
            damping: mix_damping(&a.damping, &b.damping)?,
        }),
        (Normal::Hertz(a), Normal::Hertz(b)) => Normal::Hertz(Hertz {
            effective_modulus: harmonic(a.effective_modulus, b.effective_modulus),
            restitution: geometric(a.restitution, b.restitution),
        }),
        (Normal::Viscoelastic(a), Normal::Viscoelastic(b)) => Normal::Viscoelastic(Viscoelastic {
            effective_modulus: harmonic(a.effective_modulus, b.effective_modulus),
            dissipation: geometric(a.dissipation, b.dissipation),
        }),
        (Normal::Jkr(a), Normal::Jkr(b)) => Normal::Jkr(Jkr {
            surface_energy: geometric(a.surface_energy, b.surface_energy),
            elasticity: Elasticity {
                youngs_modulus: harmonic(a.elasticity.youngs_modulus, b.elasticity.youngs_modulus),
                poissons_ratio: 0.5 * (a.elasticity.poissons_ratio + b.elasticity.poissons_ratio),
            },
            damping_rate: geometric(a.damping_rate, b.damping_rate),
            critical_rolling: geometric(a.critical_rolling, b.critical_rolling),
        }),
        _ => return None,
    })
}

fn mix_tangential(a: &Tangential, b: &Tangential) -> Option<Tangential> {
    Some(match (a, b) {
        (Tangential::None, _) | (_, Tangential::None) => Tangential::None,
        (Tangential::Linear(a), Tangential::Linear(b)) => Tangential::Linear(TangentialSpring {
            stiffness: match (a.stiffness, b.stiffness) {
                (SpringStiffness::Ratio(a), SpringStiffness::Ratio(b)) => {
                    SpringStiffness::Ratio(geometric(a, b))
                }
                (SpringStiffness::Absolute(a), SpringStiffness::Absolute(b)) => {
                    SpringStiffness::Absolute(harmonic(a, b))
                }
                _ => return None,
            },
            damping: mix_damping(&a.damping, &b.damping)?,
            friction: geometric(a.friction, b.friction),
        }),
        (Tangential::Mindlin(a), Tangential::Mindlin(b)) if a.memory == b.memory => {
            Tangential::Mindlin(Mindlin {
                effective_shear: harmonic(a.effective_shear, b.effective_shear),
                restitution: geometric(a.restitution, b.restitution),
                friction: geometric(a.friction, b.friction),
                memory: a.memory,
            })
        }
        (Tangential::Jkr, Tangential::Jkr) => Tangential::Jkr,
        _ => return None,
    })
}

fn mix_rolling(a: &Rolling, b: &Rolling) -> Option<Rolling> {
    Some(match (a, b) {
        (Rolling::None, _) | (_, Rolling::None) => Rolling::None,
        (Rolling::Epsd(a), Rolling::Epsd(b)) => Rolling::Epsd(Epsd {
            rolling_friction: geometric(a.rolling_friction, b.rolling_friction),
            damping_ratio: geometric(a.damping_ratio, b.damping_ratio),
        }),
        (Rolling::Shape(a), Rolling::Shape(b)) => Rolling::Shape(ShapeParameter {
            beta: geometric(a.beta, b.beta),
            rolling_friction: geometric(a.rolling_friction, b.rolling_friction),
            twisting_friction: geometric(a.twisting_friction, b.twisting_friction),
        }),
        (Rolling::Jkr, Rolling::Jkr) => Rolling::Jkr,
        _ => return None,
    })
}

fn mix_cohesion(a: &Cohesion, b: &Cohesion) -> Option<Cohesion> {
    let asperity = |a: Option<f64>, b: Option<f64>| match (a, b) {
        (Some(a), Some(b)) => Some(geometric(a, b)),
        (one, other) => one.or(other),
    };
    Some(match (*a, *b) {
        (Cohesion::None, _) | (_, Cohesion::None) => Cohesion::None,
        (
            Cohesion::Dmt {
                work_of_adhesion: a,
                asperity_radius: p,
            },
            Cohesion::Dmt {
                work_of_adhesion: b,
                asperity_radius: q,
            },
        ) => Cohesion::Dmt {
            work_of_adhesion: geometric(a, b),
            asperity_radius: asperity(p, q),
        },
        (
            Cohesion::Scheeres {
                cleanliness: a,
                asperity_radius: p,
            },
            Cohesion::Scheeres {
                cleanliness: b,
                asperity_radius: q,
            },
        ) => Cohesion::Scheeres {
            cleanliness: geometric(a, b),
            asperity_radius: asperity(p, q),
        },
        (
            Cohesion::Constant {
                strength: a,
                patch: p,
            },
            Cohesion::Constant {
                strength: b,
                patch: q,
            },
        ) => Cohesion::Constant {
            strength: geometric(a, b),
            patch: geometric(p, q),
        },
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const SOFT: Elasticity = Elasticity {
        youngs_modulus: 1e9,
        poissons_ratio: 0.2,
    };
    const STEEL: Elasticity = Elasticity {
        youngs_modulus: 210e9,
        poissons_ratio: 0.3,
    };

    #[test]
    fn mixed_hertz_mindlin_is_the_theory_s_own_pair() {
        let a = ContactLaw::hertz_mindlin(SOFT, 0.5, 0.3);
        let b = ContactLaw::hertz_mindlin(STEEL, 0.8, 0.2);
        let table = LawTable::new(&Laws {
            own: vec![a, b],
            pairs: vec![],
        })
        .unwrap();
        let pair = table.between(0, 1);
        let Normal::Hertz(hertz) = pair.normal else {
            panic!("{pair:?}")
        };
        let Tangential::Mindlin(mindlin) = pair.tangential else {
            panic!("{pair:?}")
        };
        let close = |a: f64, b: f64| assert!((a / b - 1.0).abs() < 1e-14, "{a} {b}");
        close(hertz.effective_modulus, SOFT.effective_modulus(&STEEL));
        close(mindlin.effective_shear, SOFT.effective_shear(&STEEL));
        close(hertz.restitution, 0.4_f64.sqrt());
        close(mindlin.friction, 0.06_f64.sqrt());
        assert_eq!(pair, table.between(1, 0));
    }

    #[test]
    fn a_pair_may_be_given_and_a_part_may_be_missing() {
        let mut a = ContactLaw::hertz_mindlin(SOFT, 0.5, 0.3);
        a.cohesion = Cohesion::Dmt {
            work_of_adhesion: 0.028,
            asperity_radius: None,
        };
        let b = ContactLaw::hertz_mindlin(STEEL, 0.6, 0.5);
        let given = ContactLaw::hertz_mindlin(SOFT, 0.4, 0.2);
        let table = LawTable::new(&Laws {
            own: vec![a, b],
            pairs: vec![(0, 1, given)],
        })
        .unwrap();
        assert_eq!(*table.between(1, 0), given);
        assert_eq!(table.composition(), Composition::HertzMindlin);
        assert!(table.table().cohesive);
        // Coefficients of the part that only one has are zero for the others.
        assert_eq!(table.table().rows[3][6..9], [0.0; 3]);
        assert!(table.table().rows[0][7] > 0.0);
    }

    #[test]
    fn a_pair_that_is_given_twice_is_refused() {
        let a = ContactLaw::hertz_mindlin(SOFT, 0.5, 0.3);
        let b = ContactLaw::hertz_mindlin(STEEL, 0.6, 0.5);
        let own = vec![a, b];
        for pairs in [vec![(0, 1, a), (1, 0, b)], vec![(1, 1, a), (1, 1, a)]] {
            let twice = LawTable::new(&Laws {
                own: own.clone(),
                pairs,
            });
            let error = twice.unwrap_err().to_string();
            assert!(error.contains("their number = 2"), "{error}");
        }
    }

    #[test]
    fn what_does_not_go_together_is_refused_with_the_reason() {
        let reason = |law: ContactLaw| LawTable::new(&law.into()).unwrap_err().to_string();
        let mut law = ContactLaw::hertz_mindlin(SOFT, 0.5, 0.3);
        law.tangential = Tangential::Linear(TangentialSpring::matched(2.0 / 7.0, 1.0, 0.5));
        assert!(reason(law).contains("N/m"), "{}", reason(law));
        law.tangential = Tangential::None;
        law.rolling = Rolling::Epsd(Epsd {
            rolling_friction: 0.2,
            damping_ratio: 0.3,
        });
        assert!(reason(law).contains("roll"));
        let mut linear = ContactLaw::linear(
            Hooke::matched(1e5, 0.5),
            TangentialSpring::matched(2.0 / 7.0, 1.0, 0.5),
            None,
        );
        linear.rolling = Rolling::Jkr;
        assert!(reason(linear).contains("JKR"));
        let soft = ContactLaw::hertz_mindlin(SOFT, 0.5, 0.3);
        linear.rolling = Rolling::None;
        let unlike = Laws {
            own: vec![soft, linear],
            pairs: vec![],
        };
        assert!(LawTable::new(&unlike).is_err());
    }
}
