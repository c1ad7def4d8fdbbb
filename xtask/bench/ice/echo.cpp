// The pair of `cargo xtask bench ice`: a query over Ice, as RoboComp's components do it: C++11 mapping, one thread in
// each pool, tcp on the local host.
//
// `echo server` says `ready PROXY` and answers until its standard input ends. `echo client PROXY` speaks the protocol of
// bench_protocol: it says `ready`, takes orders `query SIZE COUNT` and says `times NANOSECONDS …`.

#include "Echo.h"
#include <Ice/Ice.h>
#include <chrono>
#include <iostream>
#include <sstream>
#include <string>
#include <vector>

using namespace std;

namespace
{

class EchoI : public RcBench::Echo
{
public:
    RcBench::Bytes giveBack(RcBench::Bytes data, const Ice::Current&) override
    {
        return data;
    }
};

int serve(const shared_ptr<Ice::Communicator>& communicator)
{
    // The system chooses the port.
    auto adapter = communicator->createObjectAdapterWithEndpoints("Echo", "tcp -h localhost");
    auto proxy = adapter->add(make_shared<EchoI>(), Ice::stringToIdentity("echo"));
    adapter->activate();
    cout << "ready " << communicator->proxyToString(proxy) << endl;
    for (string line; getline(cin, line);)
    {
    }
    return 0;
}

int ask(const shared_ptr<Ice::Communicator>& communicator, const string& address)
{
    auto echo = Ice::checkedCast<RcBench::EchoPrx>(communicator->stringToProxy(address));
    if (!echo)
    {
        cerr << "echo: there is no Echo at " << address << endl;
        return 3;
    }
    cout << "ready" << endl;
    for (string line; getline(cin, line);)
    {
        istringstream words(line);
        string kind;
        size_t size = 0;
        size_t count = 0;
        if (!(words >> kind >> size >> count) || kind != "query")
        {
            cerr << "echo: `" << line << "` is not an order" << endl;
            return 3;
        }
        const RcBench::Bytes data(size, 7);
        ostringstream times;
        for (size_t i = 0; i < count; ++i)
        {
            const auto start = chrono::steady_clock::now();
            const auto answer = echo->giveBack(data);
            const auto took = chrono::steady_clock::now() - start;
            times << ' ' << chrono::duration_cast<chrono::nanoseconds>(took).count();
            if (answer.size() != size)
            {
                cerr << "echo: another echo" << endl;
                return 3;
            }
        }
        cout << "times" << times.str() << endl;
    }
    return 0;
}

}

int main(int argc, char* argv[])
{
    try
    {
        Ice::CommunicatorHolder communicator(argc, argv);
        const vector<string> arguments(argv + 1, argv + argc);
        if (arguments.size() == 1 && arguments[0] == "server")
        {
            return serve(communicator.communicator());
        }
        if (arguments.size() == 2 && arguments[0] == "client")
        {
            return ask(communicator.communicator(), arguments[1]);
        }
        cerr << "usage: echo server | client PROXY" << endl;
        return 2;
    }
    catch (const exception& error)
    {
        cerr << "echo: error: " << error.what() << endl;
        return 3;
    }
}
