from gaitopt.simulation.engine_choice import default_engine as default_engine
from gaitopt.simulation.scipy_engine import ScipyEngine as ScipyEngine
from gaitopt.simulation.simulator import Event as Event
from gaitopt.simulation.simulator import Rollout as Rollout
from gaitopt.simulation.simulator import simulate as simulate
from gaitopt.simulation.verification import Tolerances as Tolerances
from gaitopt.simulation.verification import replay as replay
from gaitopt.simulation.verification import verify as verify
