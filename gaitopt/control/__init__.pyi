from gaitopt.control.computed_torque import computed_torque as computed_torque
from gaitopt.control.joint_pd import joint_pd as joint_pd
from gaitopt.control.law import Law as Law
from gaitopt.control.law import feedforward as feedforward
from gaitopt.control.law import passive as passive
from gaitopt.control.phase_variable import by_stance_angle as by_stance_angle
from gaitopt.control.state_feedback import state_feedback as state_feedback
from gaitopt.control.step_to_step import step_to_step as step_to_step
