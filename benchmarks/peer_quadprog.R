# R's quadprog: Rscript peer_quadprog.R PROBLEM RESULT (formats: qp_solvers.py, Program).
suppressMessages(library(quadprog))
args <- commandArgs(TRUE)
file <- file(args[1], "rb")
size <- readBin(file, "double", 4)
n <- size[1]; equal <- size[2]; m <- size[3]; repeats <- size[4]
P <- matrix(readBin(file, "double", n * n), n, n)
q <- readBin(file, "double", n)
G <- matrix(readBin(file, "double", m * n), m, n)
h <- readBin(file, "double", m)
close(file)
Gt <- t(G)
times <- c()
done <- 0
while (length(times) < repeats) {
  start <- Sys.time()
  s <- tryCatch(solve.QP(P, -q, Gt, h, meq = equal), error = function(e) NULL)
  times <- c(times, as.numeric(Sys.time() - start, units = "secs"))
}
file <- file(args[2], "wb")
writeBin(median(times), file)
writeBin(as.double(!is.null(s)), file)
writeBin(if (is.null(s)) rep(NaN, n) else s$solution, file)
writeBin(if (is.null(s)) rep(NaN, m) else s$Lagrangian, file)
close(file)
