from gaitopt.plot.animation import animate as animate
from gaitopt.plot.branch_figure import plot_branches as plot_branches
from gaitopt.plot.comparison_figure import plot_comparison as plot_comparison
from gaitopt.plot.curve_figure import plot_curves as plot_curves
from gaitopt.plot.gait_figure import plot_gait as plot_gait
from gaitopt.plot.gait_figure import plot_motion as plot_motion
from gaitopt.plot.saving import save_figure as save_figure
from gaitopt.plot.style import FigureStyle as FigureStyle
