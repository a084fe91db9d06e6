from gaitopt.design.robust_plan import RobustPlan as RobustPlan
from gaitopt.design.robust_plan import solve_scenarios as solve_scenarios
from gaitopt.design.scenario_test import ScenarioTest as ScenarioTest
from gaitopt.design.scenario_test import check_scenarios as check_scenarios
from gaitopt.design.scenarios import Scenario as Scenario
from gaitopt.design.scenarios import Scenarios as Scenarios
