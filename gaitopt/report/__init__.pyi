from gaitopt.report.branch_page import write_branch_page as write_branch_page
from gaitopt.report.notebook import show_in_notebook as show_in_notebook
from gaitopt.report.page import write_report as write_report
