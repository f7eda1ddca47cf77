# Runs one case in ESyS-Particle: reads case.json and start.csv of the folder it runs in, prints states and
# loop time. The number of workers comes in the environment: a master process waits for them.
import csv
import json
import math
import os
import time

from esys.lsm import *
from esys.lsm.util import BoundingBox, Vec3

case = json.load(open("case.json"))
rows = [[float(w) for w in line] for line in csv.reader(open("start.csv"))]
law, dt, skin = case["law"], case["timestep"], case["skin"]
workers = int(os.environ["PEER_CORES"])
largest = max(row[0] for row in rows)

sim = LsmMpi(numWorkerProcesses=workers, mpiDimList=[workers, 1, 1])
sim.initNeighbourSearch(particleType="RotSphere", gridSpacing=2 * largest + skin, verletDist=0.5 * skin)
margin = 2 * largest
low = [c - margin for c in case["lower"]]
high = [c + margin for c in case["upper"]]
sim.setSpatialDomain(BoundingBox(Vec3(*low), Vec3(*high)))
sim.setTimeStepSize(dt)
sim.setNumTimeSteps(case["warm_up"] + case["steps"])

# One by one, each grain would cost a round of messages.
grains, masses = [], []
for k, (radius, density, _, x, y, z, vx, vy, vz, wx, wy, wz) in enumerate(rows):
    mass = 4 / 3 * math.pi * radius**3 * density
    grain = RotSphere(id=k, posn=Vec3(x, y, z), radius=radius, mass=mass)
    grain.setLinearVelocity(Vec3(vx, vy, vz))
    grain.setAngularVelocity(Vec3(wx, wy, wz))
    grains.append(grain)
    masses.append(mass)
sim.createParticles(grains)

# Walls know no Hertz here: a spring that is as stiff at an overlap of a hundredth of the radius. What is
# given is multiplied by pi times the radius of the grain (measured: one grain pressed onto a wall).
mean = sum(row[0] for row in rows) / len(rows)
young = law["young"] / (2 * (1 - law["poisson"] ** 2))
stiffness = 4 / 3 * young * mean * math.sqrt(0.01) / (math.pi * mean)
for k, wall in enumerate(case["walls"]):
    place, normal = [0.0] * 3, [0.0] * 3
    place[wall["axis"]] = wall["position"]
    normal[wall["axis"]] = 1.0 if wall["grains_above"] else -1.0
    name = "wall%d" % k
    sim.createWall(name=name, posn=Vec3(*place), normal=Vec3(*normal))
    sim.createInteractionGroup(NRotElasticWallPrms(name=name + " spring", wallName=name, normalK=stiffness))

sim.createInteractionGroup(
    HertzMindlinViscoPrms(
        name="contact",
        youngsModulus=law["young"],
        poissonsRatio=law["poisson"],
        dynamicMu=law["friction"],
        restitution=law["restitution"],
    )
)
sim.createGravity(GravityPrms(name="gravity", acceleration=Vec3(*case["gravity"])))


def report(step):
    kinetic = moment = 0.0
    for grain in sim.getParticleList():
        v, mass = grain.getLinearVelocity(), masses[grain.getId()]
        kinetic += 0.5 * mass * v.dot(v)
        moment += mass * grain.getPosn()[2]
    print("state %d %.12g %.12g" % (step, kinetic, moment / sum(masses)), flush=True)


print("version ESyS-Particle", sim.getLsmVersion())
wall, steps = 0.0, 0
for step in range(0, case["warm_up"] + case["steps"], case["every"]):
    started = time.perf_counter()
    for _ in range(case["every"]):
        sim.runTimeStep()
    if step >= case["warm_up"]:
        wall += time.perf_counter() - started
        steps += case["every"]
    report(step + case["every"])
# Workers share the clock's process tree with the waiting master: their processor time cannot be told.
print("loop %d %.6f -" % (steps, wall), flush=True)
sim.exit()
