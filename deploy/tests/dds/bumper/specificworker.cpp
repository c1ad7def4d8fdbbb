#include "specificworker.h"

SpecificWorker::SpecificWorker(const ConfigLoader& configLoader, TuplePrx tprx, bool startup_check) : GenericWorker(configLoader, tprx)
{
	this->startup_check_flag = startup_check;
	if(this->startup_check_flag)
	{
		this->startup_check();
	}
	else
	{
		#ifdef HIBERNATION_ENABLED
			hibernationChecker.start(500);
		#endif

		statemachine.setChildMode(QState::ExclusiveStates);
		statemachine.start();

		auto error = statemachine.errorString();
		if (error.length() > 0){
			qWarning() << error;
			throw error;
		}
	}
}

SpecificWorker::~SpecificWorker()
{
	std::cout << "Destroying SpecificWorker" << std::endl;
}

void SpecificWorker::initialize()
{
	std::cout << "initialize worker" << std::endl;
	distance = configLoader.get<double>("Bumper.Distance");
	speed = configLoader.get<double>("Bumper.Speed");
	setPeriod("Compute", 50);
}

void SpecificWorker::compute()
{
	try
	{
		const auto scan = laser_proxy->getLaserData();
		const bool touches = enabled and nearest(scan) < distance;
		{
			QMutexLocker lock(&mutex);
			sensors["front"] = RoboCompBumper::SensorState{0, touches ? 1 : 0};
		}
		if (touches)
			differentialrobot_proxy->setSpeedBase(0, 0.8);
		else
			differentialrobot_proxy->setSpeedBase(speed, 0);
	}
	catch (const Ice::Exception &e)
	{
		std::cout << e.what() << std::endl;
	}
}

float SpecificWorker::nearest(const RoboCompLaser::TLaserData &scan) const
{
	float least = std::numeric_limits<float>::max();
	for (const auto &point : scan)
		if (std::fabs(point.angle) < 0.6)
			least = std::min(least, point.dist);
	return least;
}

void SpecificWorker::emergency()
{
	differentialrobot_proxy->stopBase();
}

//Execute one when exiting to emergencyState
void SpecificWorker::restore()
{
	std::cout << "Restore worker" << std::endl;
}

int SpecificWorker::startup_check()
{
	std::cout << "Startup check" << std::endl;
	QTimer::singleShot(200, QCoreApplication::instance(), SLOT(quit()));
	return 0;
}

void SpecificWorker::Bumper_disable()
{
	enabled = false;
}

void SpecificWorker::Bumper_enable()
{
	enabled = true;
}

RoboCompBumper::SensorStateMap SpecificWorker::Bumper_getSensorData()
{
	QMutexLocker lock(&mutex);
	return sensors;
}

bool SpecificWorker::Bumper_isEnabled()
{
	return enabled;
}

void SpecificWorker::Bumper_reset()
{
	enabled = true;
}

/**************************************/
// From the RoboCompLaser you can call this methods:
// RoboCompLaser::TLaserData this->laser_proxy->getLaserData()
// From the RoboCompLaser you can use this types:
// RoboCompLaser::TData
