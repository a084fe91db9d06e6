from gaitopt.continuation.branch import Branch as Branch
from gaitopt.continuation.branch import SpecialPoint as SpecialPoint
from gaitopt.continuation.tracing import trace_branch as trace_branch
